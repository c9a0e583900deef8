"""Writes files of Rhino for tests."""

from pathlib import Path
from typing import Any

import rhino3dm as rhino


def new_file(unit: str = "Millimeters", tolerance: float = 1e-3) -> Any:
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = getattr(rhino.UnitSystem, unit)
    file.Settings.ModelAbsoluteTolerance = tolerance
    return file


def file_bytes(file: Any, folder: Path) -> bytes:
    path = folder / "part.3dm"
    assert file.Write(str(path), 8)
    return path.read_bytes()


def attributes(name: str = "", color: tuple[int, int, int] | None = None, layer: int = -1) -> Any:
    """Attributes of an object: its own colour, or that of its layer."""
    result = rhino.ObjectAttributes()
    result.Name = name
    if color is not None:
        result.ColorSource = rhino.ObjectColorSource.ColorFromObject
        result.ObjectColor = (*color, 255)
    elif layer >= 0:
        result.ColorSource = rhino.ObjectColorSource.ColorFromLayer
        result.LayerIndex = layer
    return result


def add_layer(file: Any, color: tuple[int, int, int]) -> int:
    layer = rhino.Layer()
    layer.Name, layer.Color = f"layer {color}", (*color, 255)
    return int(file.Layers.Add(layer))


def box(width: float, depth: float, height: float) -> Any:
    corners = rhino.Point3d(0, 0, 0), rhino.Point3d(width, depth, height)
    return rhino.Brep.CreateFromBox(rhino.Box(rhino.BoundingBox(*corners)))


def plate_with_hole(width: float, radius: float, height: float) -> Any:
    """An extrusion: a square with a round hole in its middle, where the origin is."""
    half = width / 2
    corners = [(-half, -half), (half, -half), (half, half), (-half, half), (-half, -half)]
    outline = rhino.Polyline([rhino.Point3d(x, y, 0) for x, y in corners]).ToPolylineCurve()
    extrusion = rhino.Extrusion.Create(outline, height, True)
    # Inner profiles are in the plane of the outer one, whose origin is its first point.
    circle = rhino.Circle(rhino.Point3d(half, half, 0), radius)
    assert extrusion.AddInnerProfile(circle.ToNurbsCurve())
    return extrusion


def add_block(file: Any, name: str, items: list[tuple[Any, Any]]) -> Any:
    """The id of a block with these objects and their attributes."""
    number = file.InstanceDefinitions.Add(
        name,
        "",
        "",
        "",
        rhino.Point3d(0, 0, 0),
        tuple(i[0] for i in items),
        tuple(i[1] for i in items),
    )
    return file.InstanceDefinitions[number].Id


def reference(id: Any, transform: Any) -> Any:
    """An instance of a block."""
    return rhino.InstanceReference(id, transform)
