"""`make bench`: all benchmarks, one table after another.

    python -m tools.benchmarks [SECTION …]

Programs that are compared run alternately, so compare ratios. The exit status is 1 if a measured
value exceeds its limit.
"""

import sys
from collections.abc import Sequence
from importlib import import_module

from service.settings.runtime import pin_blas

SECTIONS = ("evaluation", "methods", "encoders", "queries", "requests", "hostile")


def main(sections: Sequence[str]) -> int:
    """Measures all or the named sections; returns 0 if all limits are kept."""
    pin_blas()
    kept = []
    for name in sections or SECTIONS:
        # Imported late, because the processes of `hostile` import this module too.
        kept.append(import_module(f"tools.benchmarks.{name}").run() is not False)
        print(flush=True)
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
