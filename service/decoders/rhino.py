"""Reads files of Rhino (.3dm) with `rhino3dm`: breps, extrusions and surfaces, and their instances.

The library is in C++, so this module runs only in a child process (`service.decoders.child`).
"""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import rhino3dm

from service.decoders.cad.content import (
    CadContent,
    Definition,
    FileLimits,
    Part,
    Placement,
    Reading,
    SkippedFace,
)
from service.decoders.cad.parts import Color, PartBuilder
from service.decoders.confinement import limit_step
from service.decoders.format import build_malformed_error, check_entities, check_faces
from service.decoders.rhino_breps import read_brep, read_surface

UNITS: dict[str, tuple[str, float]] = {
    "Angstroms": ("angstrom", 1e-10),
    "Nanometers": ("nanometre", 1e-9),
    "Microns": ("micrometre", 1e-6),
    "Millimeters": ("millimetre", 1e-3),
    "Centimeters": ("centimetre", 1e-2),
    "Decimeters": ("decimetre", 0.1),
    "Meters": ("metre", 1.0),
    "Dekameters": ("decametre", 10.0),
    "Hectometers": ("hectometre", 100.0),
    "Kilometers": ("kilometre", 1e3),
    "Megameters": ("megametre", 1e6),
    "Gigameters": ("gigametre", 1e9),
    "Microinches": ("microinch", 2.54e-8),
    "Mils": ("mil", 2.54e-5),
    "Inches": ("inch", 0.0254),
    "Feet": ("foot", 0.3048),
    "Yards": ("yard", 0.9144),
    "Miles": ("mile", 1609.344),
    "PrinterPoints": ("point", 0.0254 / 72),
    "PrinterPicas": ("pica", 0.0254 / 6),
    "NauticalMiles": ("nautical mile", 1852.0),
}
"""Name and metres of each unit of length of openNURBS, except those of astronomy."""

OPEN_SECONDS, OPEN_BYTE_SECONDS = 1.0, 1e-6
"""The most processor time for the library to open a file, and for each byte of it: in damaged files
of 60 kB it may search for a minute. To convert the parts then takes longer, 1 ms for a face."""

_BREPS = {"Brep", "Extrusion", "Surface"}
"""Kinds of objects that become parts."""

_OF_INSTANCE = "ColorFromParent"
"""The source of the colour of an object that has that of the instance it is in."""


def read(content: bytes, limits: FileLimits) -> CadContent:
    """The parts and instances of a file.

    Raises
    ------
    MalformedBody
        The file is not one of Rhino, or is damaged: it has checksums.
    TooLarge
        It has too many objects or faces.
    """
    with limit_step(OPEN_SECONDS + OPEN_BYTE_SECONDS * len(content)):
        file = rhino3dm.File3dm.FromByteArray(content)
    if file is None:
        message, needed = "The file cannot be read as a file of Rhino.", "a .3dm file"
        raise build_malformed_error(message, "a damaged file, or another format", needed)
    check_entities(len(file.Objects), limits)
    return _FileReader(file, limits).read()


class _FileReader:
    """The state of reading one file."""

    def __init__(self, file: Any, limits: FileLimits) -> None:
        self._file = file
        self._limits = limits
        tolerance = file.Settings.ModelAbsoluteTolerance
        self._uncertainty = float(tolerance) if 0 < tolerance < 1e12 else None
        blocks = file.InstanceDefinitions
        self._blocks = [blocks[number] for number in range(len(blocks))]
        self._block_numbers = {str(block.Id): n for n, block in enumerate(self._blocks)}
        self._objects: dict[str, Any] = {}
        self._colored = set[int]()
        self._skipped = Counter[str]()
        self._skipped_faces: list[SkippedFace] = []
        self._solids = self._faces = 0
        self._vertex_gap = 0.0

    def read(self) -> CadContent:
        """All that is in the file: a definition for each block, then one for each other part."""
        objects = [self._file.Objects[number] for number in range(len(self._file.Objects))]
        self._objects = {str(each.Attributes.Id): each for each in objects}
        self._colored = {n for n, block in enumerate(self._blocks) if self._takes_color(block)}
        definitions = [self._read_block(block) for block in self._blocks]
        self._skipped["InstanceReference"] += drop_circles(definitions)
        roots = []
        for each in objects:
            if each.Attributes.IsInstanceDefinitionObject:
                continue
            if each.Attributes.ActiveSpace.name == "PageSpace":
                self._skipped["PageSpace"] += 1
            elif (placement := self._read_reference(each)) is not None:
                roots.append(placement)
            elif (part := self._read_part(each)) is not None:
                roots.append(Placement(len(definitions)))
                definitions.append(Definition(part.name, (part,)))
        reading = self._report(definitions)
        return CadContent(tuple(definitions), tuple(roots), reading, reading.metres_per_unit)

    def _takes_color(self, block: Any) -> bool:
        """Whether all objects of a block have the colour of its instances."""
        found = (self._objects.get(str(id)) for id in block.GetObjectIds())
        return all(each.Attributes.ColorSource.name == _OF_INSTANCE for each in found if each)

    def _read_block(self, block: Any) -> Definition:
        """The product of a block; its objects are among those of the file."""
        parts, placements = [], []
        for id in block.GetObjectIds():
            found = self._objects.get(str(id))
            if found is None:
                self._skipped["missing object of a block"] += 1
            elif (placement := self._read_reference(found)) is not None:
                placements.append(placement)
            elif (part := self._read_part(found)) is not None:
                parts.append(part)
        return Definition(block.Name, tuple(parts), tuple(placements))

    def _read_reference(self, found: Any) -> Placement | None:
        """The placement of a block; None if the object is something else."""
        reference = found.Geometry
        if reference.ObjectType.name != "InstanceReference":
            return None
        number = self._block_numbers.get(str(reference.ParentIdefId))
        if number is None:
            return None
        matrix = np.array(reference.Xform.ToFloatArray(True)).reshape(4, 4)
        # The colour of an instance is that of the objects in it which have none of their own.
        color = self._find_color(found) if number in self._colored else None
        return Placement(number, found.Attributes.Name, matrix, color)

    def _read_part(self, found: Any) -> Part | None:
        """The part of an object; None if it is of another kind, or if nothing of it can be read."""
        geometry, attributes = found.Geometry, found.Attributes
        kind, entity = geometry.ObjectType.name, str(attributes.Id)
        if kind not in _BREPS:
            self._skipped[kind] += 1
            return None
        read = read_surface if kind == "Surface" else read_brep
        if kind == "Extrusion":
            geometry = geometry.ToBrep(True)
            if geometry is None:
                reason = "the extrusion cannot be converted to a brep"
                self._skipped_faces.append(SkippedFace(entity, reason))
                return None
        self._faces += 1 if kind == "Surface" else len(geometry.Faces)
        check_faces(self._faces, self._limits)
        builder = PartBuilder(attributes.Name, self._uncertainty, self._find_color(found))
        self._skipped_faces += read(geometry, entity, builder)
        part = builder.build()
        self._vertex_gap = max(self._vertex_gap, builder.vertex_gap)
        self._solids += part is not None and all(shell.is_closed for shell in part.shells)
        return part

    def _find_color(self, found: Any) -> Color | None:
        """The colour of an object, or of its layer; None for the black of new layers."""
        attributes = found.Attributes
        source = attributes.ColorSource.name
        if source == _OF_INSTANCE:
            return None
        if source == "ColorFromLayer":
            layer = self._find_layer(attributes.LayerIndex)
            color = None if layer is None else layer.Color
            if color is None or tuple(color[:3]) == (0, 0, 0):
                return None
        else:
            color = attributes.DrawColor(self._file)
        return tuple(value / 255 for value in color[:3])

    def _find_layer(self, index: int) -> Any:
        layers = self._file.Layers
        return layers[index] if 0 <= index < len(layers) else None

    def _report(self, definitions: list[Definition]) -> Reading:
        """The report of reading."""
        unit, metres = UNITS.get(self._file.Settings.ModelUnitSystem.name, ("", None))
        shells = [s.is_closed for each in definitions for part in each.parts for s in part.shells]
        return Reading(
            format="3dm",
            schema=f"3DM {self._file.ArchiveVersion}",
            system=self._file.ApplicationName,
            units=(unit,) if unit else (),
            metres_per_unit=metres,
            uncertainty=self._uncertainty,
            products=len(definitions),
            solids=self._solids,
            closed_shells=sum(shells),
            open_shells=len(shells) - sum(shells),
            faces=sum(len(part.faces) for each in definitions for part in each.parts),
            skipped_entities={kind: count for kind, count in self._skipped.items() if count},
            skipped_faces=tuple(self._skipped_faces),
            vertex_gap=self._vertex_gap,
            unfollowed_references=sum(bool(block.SourceArchive) for block in self._blocks),
        )


def drop_circles(definitions: list[Definition]) -> int:
    """Leave out the placements by which a definition would be in itself; returns their number.

    The search goes down along the placements; one that leads back up is left out.
    """
    dropped = 0
    is_above: dict[int, bool] = {}
    for root in range(len(definitions)):
        if root in is_above:
            continue
        is_above[root] = True
        stack = [(root, list[Placement](), iter(definitions[root].placements))]
        while stack:
            number, kept, remaining = stack[-1]
            for placement in remaining:
                below = placement.definition
                if is_above.get(below, False):
                    dropped += 1
                    continue
                kept.append(placement)
                if below not in is_above:
                    is_above[below] = True
                    stack.append((below, [], iter(definitions[below].placements)))
                    break
            else:
                stack.pop()
                is_above[number] = False
                definitions[number] = replace(definitions[number], placements=tuple(kept))
    return dropped
