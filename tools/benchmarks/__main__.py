"""Runs benchmarks and prints their tables: `make bench`.

    python -m tools.benchmarks [SECTION …]

Programs that are compared run alternately, so that their ratios do not depend on other load of the
machine. The exit status is 1 if a measured value exceeds its limit. By default all of `SECTIONS`
run; `tools.benchmarks.open_cascade` is a program of its own.
"""

import sys
from collections.abc import Sequence
from importlib import import_module

from service.settings.runtime import pin_blas

SECTIONS = (
    *("evaluation", "methods", "encoders", "queries"),
    *("growth", "breps", "requests", "workers", "operation", "bake", "hostile"),
)


def main(sections: Sequence[str]) -> int:
    """Runs all or the named sections; returns 0 if no value exceeds its limit."""
    pin_blas()
    is_within_limits = True
    for name in sections or SECTIONS:
        # A section is imported only when it runs. The processes that `hostile` starts import this
        # module too, and would otherwise import the modules of all sections.
        section = import_module(f"tools.benchmarks.{name}")
        is_within_limits &= section.run() is not False  # None: the section has no limits
        print(flush=True)
    return 0 if is_within_limits else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
