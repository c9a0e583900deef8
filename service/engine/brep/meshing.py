"""Triangles of a whole brep, by tolerance: no crack between its faces, and a bound for each."""

from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.brep_triangulation import BrepTriangulation


def triangulate_brep(prepared: object, goal: Goal, limits: MeshLimits) -> BrepTriangulation:
    """The triangles of all faces of a prepared brep (`PreparedBrep`).

    Parameters
    ----------
    prepared : PreparedBrep
    goal : Goal
        Model units. A view becomes the tolerance that it allows at the nearest point of the box.
    limits : MeshLimits
        Of triangles and of work.

    Raises
    ------
    TooLarge
        `too_many_triangles`, `too_costly`.
    InvalidRequest
        `tolerance_too_small`.
    Cancelled
    """
    raise NotImplementedError
