"""`make bench`: everything that is measured, one table after another.

What runs against each other runs in turns: read the ratios.
"""

import sys

from service.settings.process import pin_blas
from tools.benchmarks import caching, compact, encoding, evaluation, hostile, methods

pin_blas()
for benchmark in (evaluation, methods, encoding, compact):
    benchmark.run()
    print()
fast = caching.report()
print()
sys.exit(0 if hostile.report() and fast else 1)
