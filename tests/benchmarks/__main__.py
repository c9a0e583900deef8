"""`make bench`: everything that is measured, one table after another.

What runs against each other runs in turns within one process: read the ratios.
"""

import sys

from service.settings import pin_blas
from tests.benchmarks import (
    awkward,
    doors,
    encoding,
    evaluation,
    hostile,
    methods,
    splines,
    waterfall,
)

pin_blas()
for benchmark in (evaluation, methods, awkward, splines, doors, encoding, waterfall):
    benchmark.run()
    print()
sys.exit(0 if hostile.report() else 1)
