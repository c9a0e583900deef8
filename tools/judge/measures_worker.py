"""Areas and volumes of solids by Open CASCADE, in a Python of its own.

    python -m tools.judge.measures_worker FOLDER

For each STEP file of the folder it prints a JSON line: the name, and area and volumes of the file,
as Open CASCADE reads it, and of the solid of `tools.benchmarks.solid_models` with the same name.
The library has two rules for volumes. Only a Python in which cadquery-ocp is installed can run this
program.
"""

import json
import sys
from pathlib import Path
from typing import Any

from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader

from tools.benchmarks.solid_models import MODELS

ACCURACY = 1e-12
"""The accuracy that is asked for. With 1e-9, areas of cylinders are wrong by 1e-7."""


def measure(shape: Any) -> dict[str, list[float]]:
    """The area of a shape, and its volume by both rules, as lists."""
    area, volume, other = GProp_GProps(), GProp_GProps(), GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, area, ACCURACY, False)
    BRepGProp.VolumeProperties_s(shape, volume, ACCURACY, False, False)
    BRepGProp.VolumePropertiesGK_s(shape, other, ACCURACY, False, True, False, False, False)
    return {"area": [area.Mass()], "volume": [volume.Mass(), other.Mass()]}


def main(folder: str) -> None:
    """Measures all files."""
    for path in sorted(Path(folder).glob("*.step")):
        reader = STEPControl_Reader()
        reader.ReadFile(str(path))
        reader.TransferRoots()
        values = {"file": measure(reader.OneShape())}
        if path.stem in MODELS:
            values["model"] = measure(MODELS[path.stem]())
        print(json.dumps({"name": path.stem, **values}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
