"""IGES 5.3: trimmed surfaces (144) of B-splines, subfigures, colours, names and units.

A definition that is placed is a subfigure (308), each instance of it a singular subfigure (408)
with a rotation (124); a definition that is not placed is a group (402). Names are in ASCII. The
text is the same for the same model: its time stamp is fixed. Coordinates are those of the model,
whatever its vertical axis.

References
----------
IGES 5.3 (US PRO/IPO-100-1996): 2.2.4.3 (global section), and the entities of these types.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.encoders.cad.assembly import Assembly, Definition, Instance, assemble
from service.encoders.cad.bounds import bound_iges
from service.encoders.cad.format import Allow, WrittenFile
from service.encoders.cad.iges_faces import DEFINITION, DEPENDENT, FaceWriter
from service.encoders.cad.iges_records import (
    GLOBAL_WIDTH,
    Entities,
    cut_tokens,
    list_numbers,
    write_reals,
    write_section,
    write_string,
)
from service.encoders.format import pack
from service.encoders.units import MILLIMETRE, match_unit
from service.surface.lowered import Model

UNITS = {0.0254: (1, "IN"), 0.001: (2, "MM"), 0.3048: (4, "FT"), 1609.344: (5, "MI"), 1.0: (6, "M"),
         1000.0: (7, "KM"), 2.54e-5: (8, "MIL"), 1e-6: (9, "UM"), 0.01: (10, "CM"),
         2.54e-8: (11, "UIN")}  # fmt: skip
"""The number and the name of each unit of length, in metres."""

TIME = "15H20000101.000000"
"""The time stamp: always the same, so that equal models have equal files."""


def encode(model: Model, metres_per_unit: float | None, allow: Allow) -> WrittenFile:
    """The IGES file of a model; raises the errors of `assemble`, and those of `allow`."""
    assembly = assemble(model, metres_per_unit)
    allow(bound_iges(assembly))
    entities = Entities()
    writer = _Writer(assembly, entities)
    writer.write()
    directory, parameters = entities.finish()
    start = write_section([""], "S")
    parameters_of_file = _list_globals(assembly, writer.scale)
    head = write_section(cut_tokens(parameters_of_file, GLOBAL_WIDTH), "G")
    counts = f"S{len(start):7d}G{len(head):7d}D{2 * entities.count:7d}P{entities.records:7d}"
    first, last = "".join(start + head), f"{counts:<72}T{1:7d}\n"
    content = pack((first.encode(), *directory, *parameters, last.encode()))
    metres = find_unit(assembly.metres_per_unit)
    return WrittenFile(content, replace(assembly.report(), metres_per_unit=metres))


def _list_globals(assembly: Assembly, scale: float) -> list[str]:
    """The parameters of the global section: precisions, the unit, the time, the uncertainty."""
    number, name = UNITS[find_unit(assembly.metres_per_unit)]
    title = write_string(assembly.name) or "7Hsurface"
    system = write_string("Surface Service")
    bodies = [body for each in assembly.definitions for body in each.bodies]
    uncertainty = max((body.uncertainty for body in bodies), default=1e-9)
    largest = max((float(np.abs(np.stack(body.bounds)).max()) for body in bodies), default=0.0)
    numbers = write_reals(scale * np.array([uncertainty, largest]))
    precisions = ("32", "38", "6", "308", "15")
    unit = (str(number), f"{len(name)}H{name}")
    return [
        *("1H,", "1H;", title, title, system, system, *precisions, title, "1.0", *unit),
        *("1", "0.0", TIME, *numbers.split(","), "", "", "11", "0", TIME, ""),
    ]


def find_unit(metres: float) -> float:
    """The unit in which a model is written: its own, or a millimetre if IGES does not have it."""
    return match_unit(metres, UNITS) or MILLIMETRE


class _Writer:
    """Adds the entities of an assembly."""

    def __init__(self, assembly: Assembly, entities: Entities) -> None:
        self.assembly = assembly
        self.entities = entities
        metres = assembly.metres_per_unit
        unit = match_unit(metres, UNITS)
        self.scale = metres / MILLIMETRE if unit is None else 1.0
        self.faces = FaceWriter(entities, self.scale)

    def write(self) -> None:
        """Add all definitions and instances."""
        definitions = self.assembly.definitions
        if not self.assembly.instances:
            for definition in definitions:
                self._write_group(definition)
            return
        subfigures = [self._write_subfigure(definition) for definition in definitions]
        self._write_tree(subfigures)

    def _write_group(self, definition: Definition) -> None:
        """The faces of a definition as a named group."""
        faces = self.faces.write_faces(definition)
        name = self.faces.write_name(definition.name)
        tail = f",0,1,{name}" if name else ""
        self.entities.add(402, f"{len(faces)},{list_numbers(faces)}{tail}", form=7)

    def _write_subfigure(self, definition: Definition) -> tuple[int, int]:
        """The definition of a subfigure, and how deep subfigures are nested in it."""
        faces = self.faces.write_faces(definition)
        return self._add_subfigure(definition.name, faces, 0), 0

    def _add_subfigure(self, name: str, parts: Sequence[int], depth: int) -> int:
        title = write_string(name) or "4Hpart"
        tokens = [str(depth), title, str(len(parts)), *map(str, parts)]
        return self.entities.add(308, tokens, status=DEFINITION)

    def _write_tree(self, subfigures: Sequence[tuple[int, int]]) -> None:
        """The instances, a subfigure for each node with nodes below it."""
        instances, below = self.assembly.instances, self.assembly.list_below()
        figures = [(0, 0)] * len(instances)
        # Nodes come after the nodes above them, so backwards all nodes below come first.
        for number in range(len(instances) - 1, -1, -1):
            instance = instances[number]
            if not below[number] and instance.definition is not None:
                figures[number] = subfigures[instance.definition]
                continue
            parts = [self._place(figures[k][0], instances[k], is_root=False) for k in below[number]]
            if instance.definition is not None:
                own = replace(instance, matrix=None)
                parts.insert(0, self._place(subfigures[instance.definition][0], own, is_root=False))
            depth = 1 + max((figures[k][1] for k in below[number]), default=0)
            figures[number] = self._add_subfigure(instance.name, parts, depth), depth
        for number in below[-1]:
            self._place(figures[number][0], instances[number], is_root=True)

    def _place(self, figure: int, instance: Instance, *, is_root: bool) -> int:
        """An instance of a subfigure."""
        transformation = 0
        if instance.matrix is not None:
            rows = instance.matrix[:3].copy()
            rows[:, 3] *= self.scale
            transformation = self.entities.add(124, write_reals(rows), status=DEPENDENT)
        title = self.faces.write_name(instance.name)
        tail = f",0,1,{title}" if title else ""
        return self.entities.add(
            408,
            f"{figure},0.0,0.0,0.0,1.0{tail}",
            matrix=transformation,
            status="00000000" if is_root else DEPENDENT,
        )
