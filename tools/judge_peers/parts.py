"""Writes twenty solids as STEP by Open CASCADE: the parts of `make judge-peers`.

    python -m tools.judge_peers.parts FOLDER

Only a Python in which cadquery-ocp is installed can run this program. The other solids of
`tools.benchmarks.solid_models` are built-in examples.
"""

import sys
from pathlib import Path

from tools.benchmarks.solid_models import MODELS
from tools.cad_files.write import write_step
from tools.judge_peers.names import PARTS


def main(folder: str) -> None:
    """Writes a file for each part, in millimetres and with parameter curves."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for name in PARTS:
        write_step(target / f"{name}.step", MODELS[name](), "AP214IS", "MM", 1)


if __name__ == "__main__":
    main(sys.argv[1])
