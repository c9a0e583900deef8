"""`python -m service` is the command `surface`."""

import sys

from service.cli import main

sys.exit(main())
