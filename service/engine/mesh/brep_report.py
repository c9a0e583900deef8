"""The part of a mesh's report that only breps have: gaps, edges and faces that need a look."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from service.surface.brep_model import SkippedFace


@dataclass(frozen=True, slots=True)
class BrepReport:
    """The facts about a brep in the report on its mesh, in addition to those of `MeshReport`.

    Lengths are in model units.

    Attributes
    ----------
    reached : bool
        Whether the deviation bound is at most the tolerance. It is not if a face has no triangles
        and not all its edges are in the mesh.
    gap_bound : float
        It is proved that no point of an edge is further than this from the point of a face at the
        same parameter of its parameter curve.
    pcurves_replaced : int
        The number of given parameter curves that were made anew.
    complete : bool
        Whether the mesh has triangles of all faces: none was skipped, and none is degenerate.
    non_manifold_edges : int
        The number of edges of the brep with more than two coedges in one shell that could not be
        put in pairs.
    double_edges : int
        The number of pairs of vertices that more than one edge of the mesh joins.
    degenerate_faces : int
        The number of faces without triangles that are not skipped: they are narrower than a unit of
        places.
    collapsed_edges : int
        The number of edges that became one vertex, because they are shorter than their uncertainty.
    longest_chain : float
        The greatest length of consecutive edges that became one vertex.
    skipped_faces : tuple of SkippedFace
        Invalid faces that were left out, and faces whose loops cross as polygons at this tolerance.
    unbounded_reason : str or None
        If the second bound, `MeshReport.mesh_deviation_bound`, was requested but is not finite:
        why.
    """

    reached: bool = True
    gap_bound: float = 0.0
    pcurves_replaced: int = 0
    complete: bool = True
    non_manifold_edges: int = 0
    double_edges: int = 0
    degenerate_faces: int = 0
    collapsed_edges: int = 0
    longest_chain: float = 0.0
    skipped_faces: tuple[SkippedFace, ...] = ()
    unbounded_reason: str | None = None

    def scale(self, stretch: float) -> "BrepReport":
        """The report of a copy whose lengths are multiplied by at most `stretch`."""
        return replace(
            self,
            gap_bound=self.gap_bound * stretch,
            longest_chain=self.longest_chain * stretch,
        )


_COUNTS = (
    "pcurves_replaced", "non_manifold_edges", "double_edges", "degenerate_faces", "collapsed_edges"
)  # fmt: skip


def add_brep_reports(reports: Sequence[tuple[BrepReport, int]]) -> BrepReport | None:
    """The report on several meshes, each with its number of copies; None if there are none.

    The numbers of skipped faces are those of their own brep; a face is listed once for all copies.
    """
    present = [report for report, _ in reports]
    if not present:
        return None
    reasons = [report.unbounded_reason for report in present if report.unbounded_reason]
    return replace(
        present[0],
        reached=all(report.reached for report in present),
        gap_bound=max(report.gap_bound for report in present),
        complete=all(report.complete for report in present),
        longest_chain=max(report.longest_chain for report in present),
        skipped_faces=tuple(face for report in present for face in report.skipped_faces),
        unbounded_reason=reasons[0] if reasons else None,
        **{name: sum(getattr(each, name) * count for each, count in reports) for name in _COUNTS},
    )
