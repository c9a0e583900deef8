"""A small reader of 3MF for tests, which shares no code with the encoder."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from io import BytesIO
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
MATERIALS = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"

Array = NDArray[np.float64]


@dataclass
class Body:
    """A placed mesh: its object's name and type, points (N, 3), triangles and their colours.

    `colors` has for each triangle the colours of its corners as #RRGGBBAA; "" without one.
    """

    name: str
    kind: str
    points: Array
    triangles: NDArray[np.intp]
    colors: list[tuple[str, str, str]]
    object: str

    @property
    def volume(self) -> float:
        a, b, c = self.points[self.triangles].swapaxes(0, 1)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@dataclass
class File:
    root: ET.Element
    bodies: list[Body] = field(default_factory=list)

    @property
    def objects(self) -> list[ET.Element]:
        return list(self.root.iter(f"{CORE}object"))


def read(content: bytes) -> File:
    """The file with all placed meshes; asserts the structure of the package."""
    with ZipFile(BytesIO(content)) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
        assert {each.date_time for each in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        target = ET.fromstring(archive.read("_rels/.rels"))[0].attrib["Target"]
        types = archive.read("[Content_Types].xml").decode()
        assert 'Extension="rels"' in types
        assert 'Extension="model"' in types
        root = ET.fromstring(archive.read(target.lstrip("/")))
    assert root.tag == f"{CORE}model"
    assert root.attrib["unit"] == "millimeter"
    file = File(root)
    objects = {each.attrib["id"]: each for each in file.objects}
    resources = root.find(f"{CORE}resources")
    assert resources is not None
    numbers = [each.attrib["id"] for each in resources]
    assert len(numbers) == len(set(numbers))
    palettes = _read_palettes(resources)
    (item,) = root.iter(f"{CORE}item")
    stack = [(item.attrib["objectid"], read_transform(item))]
    while stack:
        number, matrix = stack.pop()
        element = objects[number]
        components = element.find(f"{CORE}components")
        if components is None:
            file.bodies.append(_read_body(element, matrix, palettes))
            continue
        for component in reversed(components):
            # What a component names comes before it.
            assert int(component.attrib["objectid"]) < int(number)
            stack.append((component.attrib["objectid"], matrix @ read_transform(component)))
    return file


def read_transform(element: ET.Element) -> Array:
    """The placement (4, 4), which acts on columns."""
    matrix = np.eye(4)
    if "transform" in element.attrib:
        numbers = [float(number) for number in element.attrib["transform"].split()]
        matrix[:3] = np.reshape(numbers, (4, 3)).T
    return matrix


def _read_palettes(resources: ET.Element) -> dict[str, list[str]]:
    palettes = {}
    for element in resources:
        if element.tag == f"{CORE}basematerials":
            palettes[element.attrib["id"]] = [base.attrib["displaycolor"] for base in element]
        elif element.tag == f"{MATERIALS}colorgroup":
            palettes[element.attrib["id"]] = [color.attrib["color"] for color in element]
    return palettes


def _read_body(element: ET.Element, matrix: Array, palettes: dict[str, list[str]]) -> Body:
    points = [[float(v.attrib[k]) for k in "xyz"] for v in element.iter(f"{CORE}vertex")]
    placed = np.array(points).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    triangles, colors = [], []
    default = element.attrib.get("pid"), element.attrib.get("pindex")
    for triangle in element.iter(f"{CORE}triangle"):
        corners = [int(triangle.attrib[k]) for k in ("v1", "v2", "v3")]
        assert len(set(corners)) == 3
        assert max(corners) < len(points)
        triangles.append(corners)
        pid = triangle.attrib.get("pid", default[0])
        first = triangle.attrib.get("p1", default[1])
        indices = [triangle.attrib.get(k, first) for k in ("p1", "p2", "p3")]
        if pid is None:
            colors.append(("", "", ""))
        else:
            a, b, c = (palettes[pid][int(index or 0)] for index in indices)
            colors.append((a, b, c))
    return Body(
        element.attrib["name"],
        element.attrib["type"],
        placed,
        np.array(triangles, np.intp).reshape(-1, 3),
        colors,
        element.attrib["id"],
    )
