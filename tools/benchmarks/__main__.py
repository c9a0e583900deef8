"""`make bench`: everything that is measured, one table after another.

What runs against each other runs in turns: read the ratios.
"""

import sys

from service.settings.process import pin_blas
from tools.benchmarks import encoders, evaluation, hostile, methods, requests


def main() -> int:
    """Measures everything; 0 if what has a limit keeps it."""
    pin_blas()
    for benchmark in (evaluation, methods, encoders):
        benchmark.run()
        print()
    fast = requests.run()
    return 0 if hostile.report() and fast else 1


if __name__ == "__main__":  # the processes of `hostile` import this module, too
    sys.exit(main())
