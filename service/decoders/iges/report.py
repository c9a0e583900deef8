"""The report of reading: counts, gaps, and faces that are not in the surface."""

from collections import Counter

from service.decoders.cad.content import Reading, SkippedFace
from service.decoders.cad.parts import PartBuilder
from service.decoders.iges.header import Header


class Report:
    """The report while a file is read.

    Attributes
    ----------
    solids, closed_shells, open_shells, faces, open_edges : int
    skipped_entities : Counter
        By the name of a type, such as "type 212".
    """

    def __init__(self) -> None:
        self.solids = 0
        self.closed_shells = 0
        self.open_shells = 0
        self.faces = 0
        self.open_edges = 0
        self.unfollowed_references = 0
        self.skipped_entities: Counter[str] = Counter()
        self._skipped_faces: dict[int, str] = {}
        self._edge_gap = 0.0
        self._vertex_gap = 0.0

    def skip_face(self, number: int, reason: str) -> None:
        """Note that a face is not in the surface; the first reason counts."""
        self._skipped_faces.setdefault(number, reason)

    def note_part(self, builder: PartBuilder) -> None:
        """Note the gaps and the faces of a part."""
        self.faces += builder.face_count
        self._edge_gap = max(self._edge_gap, builder.edge_gap)
        self._vertex_gap = max(self._vertex_gap, builder.vertex_gap)

    def write(self, header: Header, products: int) -> Reading:
        """The finished report."""
        return Reading(
            format="iges",
            schema=header.schema,
            system=header.system,
            units=(header.unit,) if header.unit else (),
            metres_per_unit=header.metres_per_unit,
            uncertainty=header.resolution or None,
            products=products,
            solids=self.solids,
            closed_shells=self.closed_shells,
            open_shells=self.open_shells,
            faces=self.faces,
            skipped_entities=dict(self.skipped_entities),
            skipped_faces=tuple(
                SkippedFace(f"D{number}", reason)
                for number, reason in sorted(self._skipped_faces.items())
            ),
            edge_gap=self._edge_gap,
            vertex_gap=self._vertex_gap,
            unfollowed_references=self.unfollowed_references,
            open_edges=self.open_edges,
        )
