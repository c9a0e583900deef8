"""Reads VTU files by VTK, and evaluates their cells: JSON lines.

    python -m tools.cad_files.cells FILE …

A line has for each cell its type, and its points at `PLACES`. Only a Python in which vtk is
installed can run this program.
"""

import json
import sys
from typing import Any

PLACES = ((0.25, 0.5), (0.7, 0.2), (0.1, 0.3))
"""Parameters (u, v) inside of a square and of a triangle."""


def read(path: str) -> dict[str, Any]:
    """The types of all cells, and their points."""
    import vtk  # noqa: PLC0415 -- tests import the places, but not VTK

    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    points = []
    for number in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(number)
        weights = [0.0] * cell.GetNumberOfPoints()
        own = []
        for u, v in PLACES:
            point = [0.0, 0.0, 0.0]
            cell.EvaluateLocation(vtk.mutable(0), [u, v, 0.0], point, weights)
            own.append(point)
        points.append(own)
    types = [grid.GetCellType(number) for number in range(grid.GetNumberOfCells())]
    return {"types": types, "points": points}


if __name__ == "__main__":
    for each in sys.argv[1:]:
        print(json.dumps({"file": each, **read(each)}), flush=True)
