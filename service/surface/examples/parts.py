"""Examples of whole parts: solids of trimmed faces, stored as the columns of their breps.

`python -m tools.part_examples` makes the files again from the solids of the tests.
"""

from collections.abc import Mapping
from dataclasses import fields
from importlib.resources import files
from typing import Any

import numpy as np

from service.surface.brep import BrepSurface
from service.surface.spline_tables import CurveTable, SurfaceTable

TABLES: Mapping[str, type[CurveTable] | type[SurfaceTable]] = {
    "curves": CurveTable,
    "surfaces": SurfaceTable,
    "pcurves": CurveTable,
}
"""The columns that are tables of splines; a file has each array of a table as `table.array`."""


def part(name: str) -> BrepSurface:
    """The part that is stored as `data/{name}.npz`, with z up."""
    with (
        (files(__package__) / "data" / f"{name}.npz").open("rb") as file,
        np.load(file, allow_pickle=False) as arrays,
    ):
        columns: dict[str, Any] = {key: arrays[key] for key in arrays.files}
    face_names = tuple(columns.pop("face_names").tolist())
    for table, kind in TABLES.items():
        names = [field.name for field in fields(kind) if field.init]
        columns[table] = kind(**{name: columns.pop(f"{table}.{name}") for name in names})
    return BrepSurface(**columns, face_names=face_names, up="z", name=name)
