"""Faces: a surface, loops, and which side is out.

Four flags count: `same_sense` of the face, `orientation` of the bound, of the oriented edge, and
`same_sense` of the edge curve; a trimmed surface or curve may add its own, and an oriented shell
turns its faces once more. Loops run counter-clockwise about the face's normal.

References
----------
ISO 10303-42, clause 5.4: face_surface, face_bound, oriented_face, subface;
ISO 10303-511: advanced_face.
"""

import numpy as np

from service.decoders.cad.content import Surface
from service.decoders.cad.elementary import Plane, find_gap
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import build_frame
from service.decoders.cad.parts import reverse_loop
from service.decoders.cad.swept import Swept
from service.decoders.step.edges import MAX_ORIENTED, EdgeReader, Loop, find_reason
from service.decoders.step.entities import Entities, Entity, unsupported
from service.decoders.step.faults import Fault
from service.decoders.step.pcurves import PcurveReader
from service.decoders.step.records import as_flag, as_reference, as_references, as_text
from service.decoders.step.styles import Color, Styles
from service.decoders.step.surfaces import Oriented, SurfaceReader
from service.decoders.step.tally import Tally

FACES = ("ADVANCED_FACE", "FACE_SURFACE", "ORIENTED_FACE", "SUBFACE", "FACE")

NO_NAMES = ("", "NONE", "none")


class FaceReader:
    """Reads the faces of one part into its builder."""

    def __init__(
        self,
        entities: Entities,
        surfaces: SurfaceReader,
        edges: EdgeReader,
        styles: Styles,
        tally: Tally,
    ) -> None:
        self._entities = entities
        self._surfaces = surfaces
        self._edges = edges
        self._pcurves = PcurveReader(entities, edges)
        self._builder = edges.builder
        self._styles = styles
        self._tally = tally

    def read(self, number: int, is_flipped: bool, color: Color | None) -> int | None:
        """The number of a face in the part; None if it cannot be read, which is noted.

        Parameters
        ----------
        is_flipped : bool
            Whether the shell turns its faces around.
        color : tuple of floats, or None
            Of the shell, for a face without a colour of its own.
        """
        self._entities.budget.count_face()
        try:
            return self._read(number, is_flipped, color)
        except (InvalidGeometry, ArithmeticError) as error:
            self._tally.skip_face(number, find_reason(error))
            return None

    def _read(self, number: int, is_flipped: bool, color: Color | None) -> int:
        names = [number]
        entity = self._entities.read(number)
        for _ in range(MAX_ORIENTED):
            if entity.keyword != "ORIENTED_FACE":
                break
            is_flipped ^= not as_flag(entity.parameter(3))
            names.append(as_reference(entity.parameter(2)))
            entity = self._entities.read(names[-1])
        if entity.keyword not in FACES or entity.keyword == "ORIENTED_FACE":
            raise unsupported(entity, "a face")
        bounds = [self._read_bound(each) for each in as_references(entity.parameter(1))]
        surface, same_sense = self._read_surface(entity, bounds)
        loops = [loop.coedges for loop in bounds]
        self._entities.budget.charge_coedges(sum(map(len, loops)))
        vertices = [loop.vertex for loop in bounds if loop.vertex is not None]
        outline = self._builder.find_outline(loops, vertices)
        face_sense = same_sense == surface.same_sense
        if not face_sense:
            loops = [reverse_loop(loop) for loop in loops]
        if surface.number is not None:
            loops = [self._pcurves.add(loop, surface.number) for loop in loops]
        cut = surface.cut(outline)
        if not isinstance(surface.shape, Surface | Swept):
            self._builder.note_gap(find_gap(surface.shape, outline))
        self._entities.budget.count_points(cut.points.shape[0] * cut.points.shape[1])
        name = as_text(entity.parameter(0)).strip()
        return self._builder.add_face(
            cut,
            loops,
            is_reversed=face_sense == is_flipped,
            turns_with_face=False,
            name="" if name in NO_NAMES else name,
            color=self._styles.find(*names) or color,
        )

    def _read_bound(self, number: int) -> Loop:
        """A loop, turned around if its bound says so."""
        entity = self._entities.read_as(number, "FACE_OUTER_BOUND", "FACE_BOUND")
        loop = self._edges.read_loop(as_reference(entity.parameter(1)))
        return (
            loop if as_flag(entity.parameter(2)) else Loop(reverse_loop(loop.coedges), loop.vertex)
        )

    def _read_surface(self, entity: Entity, bounds: list[Loop]) -> tuple[Oriented, bool]:
        """The surface of a face, and whether the face has its normal."""
        for _ in range(MAX_ORIENTED):
            if entity.keyword in ("ADVANCED_FACE", "FACE_SURFACE"):
                surface = self._surfaces.read(as_reference(entity.parameter(2)))
                return surface, as_flag(entity.parameter(3))
            if entity.keyword == "FACE":
                return Oriented(self._find_plane(bounds)), True
            if entity.keyword != "SUBFACE":
                break
            entity = self._entities.read(as_reference(entity.parameter(2)))
        raise unsupported(entity, "a face")

    def _find_plane(self, bounds: list[Loop]) -> Plane:
        """The plane of a face that has none, from its first loop: a polygon (Newell's normal)."""
        points = self._builder.find_outline([bounds[0].coedges] if bounds else []).ends
        if len(points) < 3:
            raise Fault("a face has no surface")
        following = np.roll(points, -1, axis=0)
        x, y, z = np.cross(points, following).sum(axis=0).tolist()
        x0, y0, z0 = points[0].tolist()
        return Plane(build_frame((x0, y0, z0), (x, y, z)))
