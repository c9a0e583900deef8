"""`make bench`: everything that is measured, one table after another.

What runs against each other runs in turns: read the ratios.
"""

import sys

from service.settings.process import pin_blas
from tools.benchmarks import (
    awkward,
    caching,
    compact,
    doors,
    encoding,
    evaluation,
    hostile,
    methods,
    patience,
    splines,
    waterfall,
)

pin_blas()
for benchmark in (evaluation, methods, awkward, splines, doors, encoding, compact, waterfall):
    benchmark.run()
    print()
patience.run()
print()
fast = caching.report()
print()
sys.exit(0 if hostile.report() and fast else 1)
