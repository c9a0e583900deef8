"""Solids and surface models: what becomes a part.

References
----------
ISO 10303-42, clauses 5.4 and 6.4: closed_shell, open_shell, oriented_closed_shell,
manifold_solid_brep, brep_with_voids, faceted_brep, shell_based_surface_model,
face_based_surface_model.
"""

from dataclasses import dataclass

from service.decoders.cad.content import Part
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.scaling import scale_part
from service.decoders.step.curves import CurveReader
from service.decoders.step.edges import MAX_ORIENTED, EdgeReader
from service.decoders.step.entities import Entities, Entity, unsupported
from service.decoders.step.faces import NO_NAMES, FaceReader
from service.decoders.step.faults import Fault
from service.decoders.step.records import as_flag, as_list, as_reference, as_references, as_text
from service.decoders.step.styles import Styles
from service.decoders.step.surfaces import SurfaceReader
from service.decoders.step.tally import Tally
from service.decoders.step.units import Units

VOIDS = ("BREP_WITH_VOIDS", "FACETED_BREP_AND_BREP_WITH_VOIDS")
SOLIDS = ("MANIFOLD_SOLID_BREP", "FACETED_BREP", *VOIDS)
MODELS = ("SHELL_BASED_SURFACE_MODEL", "FACE_BASED_SURFACE_MODEL")
ORIENTED_SHELLS = ("ORIENTED_CLOSED_SHELL", "ORIENTED_OPEN_SHELL")
CLOSED = "CLOSED_SHELL"
SHELLS = (CLOSED, "OPEN_SHELL", "CONNECTED_FACE_SET", "CONNECTED_FACE_SUB_SET", *ORIENTED_SHELLS)
PARTS = (*SOLIDS, *MODELS, *SHELLS)
"""Items that are a part each; loose faces of one representation are a part together."""


@dataclass(slots=True)
class Gaps:
    """The largest distances that were found, in the root's unit."""

    edge: float = 0.0
    vertex: float = 0.0


class PartReader:
    """Reads parts, each once for a unit."""

    def __init__(self, entities: Entities, styles: Styles, tally: Tally) -> None:
        self._entities = entities
        self._styles = styles
        self._tally = tally
        self._geometry: dict[float, tuple[CurveReader, SurfaceReader]] = {}
        self._parts: dict[tuple[int, Units], Part | None] = {}
        self._solids: set[int] = set()
        self.gaps = Gaps()
        self.open_edges = 0

    def read(self, number: int, units: Units, metres: float | None) -> Part | None:
        """The part of a solid, a surface model or a shell; None if none of its faces can be read.

        Parameters
        ----------
        units : Units
            Of the representation that has the item.
        metres : float or None
            The root's unit, in which the part is wanted.

        Raises
        ------
        Fault
            The entity is malformed, or no part.
        """
        key = number, units
        if key not in self._parts:
            entity = self._entities.read(number)
            if entity.keyword not in PARTS:
                raise unsupported(entity, "an item")
            shells = [number] if entity.keyword in SHELLS else _list_shells(entity)
            color = self._styles.find(number)
            if color is None and len(shells) == 1:
                color = self._styles.find(*shells)
            reader = self._reader(as_text(entity.parameter(0)).strip(), units, color)
            for shell in shells:
                reader.read_shell(shell)
            part = self._parts[key] = self._finish(reader.builder, units, metres)
            if part is not None and entity.keyword in SOLIDS:
                self._solids.add(number)
        return self._parts[key]

    def count_solids(self) -> int:
        """How many solids have been read, each once."""
        return len(self._solids)

    def read_faces(self, numbers: list[int], units: Units, metres: float | None) -> Part | None:
        """The part of loose faces: an open shell."""
        reader = self._reader("", units, None)
        for number in numbers:
            reader.faces.read(number, is_flipped=False, color=None)
        return self._finish(reader.builder, units, metres)

    def _reader(self, name: str, units: Units, color: tuple[float, ...] | None) -> "_ShellReader":
        curves, surfaces = self._geometry_of(units.radians)
        length = units.metres or 1.0
        uncertainty = None if units.uncertainty is None else units.uncertainty / length
        builder = PartBuilder("" if name in NO_NAMES else name, uncertainty, color)
        edges = EdgeReader(self._entities, curves, builder, uncertainty or 0.0)
        faces = FaceReader(self._entities, surfaces, edges, self._styles, self._tally)
        return _ShellReader(self._entities, faces, builder, self._styles, self._tally)

    def _geometry_of(self, radians: float) -> tuple[CurveReader, SurfaceReader]:
        if radians not in self._geometry:
            curves = CurveReader(self._entities, radians)
            self._geometry[radians] = curves, SurfaceReader(self._entities, radians, curves)
        return self._geometry[radians]

    def _finish(self, builder: PartBuilder, units: Units, metres: float | None) -> Part | None:
        part = builder.build()
        factor = units.factor(metres)
        self.gaps.edge = max(self.gaps.edge, factor * builder.edge_gap)
        self.gaps.vertex = max(self.gaps.vertex, factor * builder.vertex_gap)
        self.open_edges += builder.open_edges
        return None if part is None else scale_part(part, factor)


class _ShellReader:
    def __init__(
        self,
        entities: Entities,
        faces: FaceReader,
        builder: PartBuilder,
        styles: Styles,
        tally: Tally,
    ) -> None:
        self._entities = entities
        self._styles = styles
        self._tally = tally
        self._used: set[int] = set()
        self.faces = faces
        self.builder = builder

    def read_shell(self, number: int) -> None:
        """Read a shell into the part; one that is malformed is counted."""
        try:
            self._read_shell(number)
        except Fault:
            self._tally.skip("CLOSED_SHELL")

    def _read_shell(self, number: int) -> None:
        entity = self._entities.read(number)
        is_flipped = False
        names = [number]
        for _ in range(MAX_ORIENTED):
            if entity.keyword not in ORIENTED_SHELLS:
                break
            is_flipped ^= not as_flag(entity.parameter(3))
            names.append(as_reference(entity.parameter(2)))
            entity = self._entities.read(names[-1])
        if entity.keyword not in SHELLS or entity.keyword in ORIENTED_SHELLS:
            raise unsupported(entity, "a shell")
        color = self._styles.find(*names)
        self._entities.budget.check_faces(len(as_list(entity.parameter(1))))
        listed = as_references(entity.parameter(1))
        # A face is in one shell of a part, once.
        numbers = [each for each in dict.fromkeys(listed) if each not in self._used]
        self._used.update(numbers)
        if len(numbers) < len(listed):
            self._tally.skip("repeated faces of shells", len(listed) - len(numbers))
        found = [self.faces.read(each, is_flipped, color) for each in numbers]
        read = [face for face in found if face is not None]
        is_closed = entity.keyword == CLOSED and len(read) == len(found)
        self.builder.add_shell(read, is_closed)


def _list_shells(entity: Entity) -> list[int]:
    """The shells of a solid, the outer one first, or of a surface model."""
    if entity.keyword in MODELS:
        return list(dict.fromkeys(as_references(entity.parameter(1))))
    shells = [as_reference(entity.parameter(1))]
    if any(keyword in entity.parts for keyword in VOIDS):
        shells += as_references(entity.parameter(2))
    return shells
