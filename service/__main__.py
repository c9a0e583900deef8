"""`python -m service` is the command `surface`."""

import sys

from service.cli.main import main

sys.exit(main())
