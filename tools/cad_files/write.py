"""Writes files of many shapes by Open CASCADE, with what they hold: a part of `make test-cad`.

    python -m tools.cad_files.write FOLDER

Each shape is written as STEP, in turn by every schema, unit and with and without parameter curves,
and as IGES, as trimmed faces and as a solid. Assemblies have names, colours and instances.
`expected.jsonl` has what each file holds, in the form of `tools.cad_files.open_cascade`: from the
shapes themselves, because Open CASCADE reads some of its own files as other solids.

Only a Python in which cadquery-ocp is installed can run this program.
"""

import json
import sys
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Any

from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.IGESControl import IGESControl_Controller, IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Controller, STEPControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

from tools.cad_files.measuring import find, measure
from tools.cad_files.shapes import SHAPES, bolt, gear, plate

SCHEMAS = ("AP203", "AP214IS", "AP242DIS")
UNITS = {"MM": 1e-3, "INCH": 0.0254, "M": 1.0, "CM": 0.01, "FT": 0.3048}
"""Names of units, and metres for each."""

STYLES = (("AP214IS", "MM", 1), ("AP203", "INCH", 0), ("AP242DIS", "M", 1))
"""Schema, unit, and whether there are parameter curves: each shape is written in each style."""

DISPUTED = {
    "offset_face": "an offset of a spline surface is not read, and is reported",
    "extruded_hyperbola_faces.igs": "Open CASCADE writes coordinates that are no numbers",
    "extruded_hyperbola_solid.igs": "Open CASCADE writes coordinates that are no numbers",
    "extruded_parabola_faces.igs": "Open CASCADE writes a parabola that misses its own ends",
    "extruded_parabola_solid.igs": "Open CASCADE writes a parabola that misses its own ends",
    "hollow_faces.igs": "faces alone do not say that a shell is a void: it is a solid of its own",
}
"""Files, by their beginning, whose reading may differ from the shape, with the reason."""

COLORS = {"plate": (0.2, 0.4, 0.8), "bolt": (0.9, 0.1, 0.1), "gear": (0.1, 0.7, 0.3)}


def set_style(schema: str, unit: str, pcurves: int) -> None:
    """Choose what the writers of STEP write."""
    STEPControl_Controller.Init_s()
    assert Interface_Static.SetCVal_s("write.step.schema", schema)
    assert Interface_Static.SetCVal_s("write.step.unit", unit)
    Interface_Static.SetIVal_s("write.surfacecurve.mode", pcurves)


def write_step(path: Path, shape: Any, schema: str, unit: str, pcurves: int) -> dict[str, Any]:
    """Write one shape as STEP; returns what the file holds."""
    set_style(schema, unit, pcurves)
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(path))
    return {**measure(shape), "metres_per_unit": UNITS[unit]}


def write_iges(path: Path, shape: Any, unit: str, mode: int) -> dict[str, Any]:
    """Write one shape as IGES: mode 0 as trimmed faces, mode 1 as a solid."""
    IGESControl_Controller.Init_s()
    writer = IGESControl_Writer(unit, mode)
    writer.AddShape(shape)
    writer.ComputeModel()
    writer.Write(str(path))
    return {**measure(shape), "metres_per_unit": UNITS[unit]}


def place(x: float, y: float, z: float, angle: float = 0.0) -> Any:
    """A placement: turned about the x axis, then moved."""
    turn, move = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), angle)
    move.SetTranslation(gp_Vec(x, y, z))
    move.Multiply(turn)
    return TopLoc_Location(move)


def write_assembly(path: Path, schema: str, unit: str, levels: int) -> dict[str, Any]:
    """Write an assembly of plates and bolts, of several levels, with names and colours."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colors = XCAFDoc_DocumentTool.ColorTool_s(document.Main())

    def name(label: Any, text: str) -> Any:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(text, True))
        return label

    def paint(label: Any, color: tuple[float, float, float]) -> None:
        kind = XCAFDoc_ColorType.XCAFDoc_ColorSurf
        colors.SetColor(label, Quantity_Color(*color, Quantity_TOC_sRGB), kind)

    models = {"plate": plate(), "bolt": bolt(), "gear": gear()}
    labels = {key: name(shapes.AddShape(each, False), key) for key, each in models.items()}
    for key, label in labels.items():
        paint(label, COLORS[key])
    yellow = shapes.AddSubShape(labels["plate"], find(models["plate"], TopAbs_FACE)[0])
    paint(yellow, (1, 1, 0))
    assembly = name(shapes.NewShape(), "plate with bolts")
    name(shapes.AddComponent(assembly, labels["plate"], place(0, 0, 0)), "plate:1")
    for number, (x, y) in enumerate(((8, 8), (32, 8), (8, 22), (32, 22)), 1):
        name(shapes.AddComponent(assembly, labels["bolt"], place(x, y, -7)), f"bolt:{number}")
    instances = 5 if levels else 6  # without levels, the gear is beside the assembly
    for level in range(levels):
        upper = name(shapes.NewShape(), f"Größe {level}")
        shapes.AddComponent(upper, assembly, place(0, 0, 0))
        shapes.AddComponent(upper, assembly, place(0, 0, 60.0 * (level + 1), 0.5 * level))
        name(shapes.AddComponent(upper, labels["gear"], place(-20, 0, 0)), "gear:1")
        assembly, instances = upper, 2 * instances + 1
    shapes.UpdateAssemblies()
    set_style(schema, unit, 1)
    writer = STEPCAFControl_Writer()
    writer.SetColorMode(True)
    writer.SetNameMode(True)
    writer.Transfer(document, STEPControl_AsIs)
    writer.Write(str(path))
    return {
        **measure(shapes.GetOneShape()),
        "metres_per_unit": UNITS[unit],
        "instances": instances,
        "products": 4 + levels if levels else 3,
        "names": ["plate with bolts", "plate", "bolt", *(f"Größe {n}" for n in range(levels))],
        "colors": [*map(list, COLORS.values()), [1, 1, 0]],
    }


def write_all(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Write all files; yields their names and what they hold."""
    units = cycle(UNITS)
    for name, build in SHAPES.items():
        shape = build()
        for schema, unit, pcurves in STYLES:
            file = f"{name}_{schema[:5].lower()}.step"
            yield file, write_step(folder / file, shape, schema, unit, pcurves)
        for mode, kind in enumerate(("faces", "solid")):
            file = f"{name}_{kind}.igs"
            yield file, write_iges(folder / file, shape, next(units), mode)
    for levels, schema in enumerate(SCHEMAS):
        for unit in ("MM", "INCH"):
            file = f"assembly_{levels}_{schema[:5].lower()}_{unit.lower()}.step"
            yield file, write_assembly(folder / file, schema, unit, levels)


def main(folder: str) -> None:
    """Write all files and `expected.jsonl`."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    lines = []
    for name, held in write_all(target):
        reasons = [reason for start, reason in DISPUTED.items() if name.startswith(start)]
        disputed = {"disputed": reasons[0]} if reasons else {}
        lines.append(json.dumps({"file": name, **held, **disputed}))
    (target / "expected.jsonl").write_text("\n".join(lines) + "\n")
    print(len(lines), "files")


if __name__ == "__main__":
    main(sys.argv[1])
