"""Meshes by angle, end to end: angles measured in the mesh, and numbers of triangles."""

from functools import cache

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.adaptive.limits import Effort, estimate_least_triangles
from service.engine.adaptive.tolerances import build_goal
from service.engine.mesh.mesh import Mesh
from service.engine.meshers import build_mesher
from service.engine.options import MeshOptions
from service.engine.stored_positions import Storage
from service.errors import TooLarge
from service.surface.bezier import BezierSurface
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel, PatchModel
from service.surface.member import Member
from tests.engine.meshing import check_sound
from tools.building import build_scene
from tools.certify.models import build_complex
from tools.examples import lower_patches

MOST, WORK = 30_000, 5e8
"""Limits of one request, in triangles and in multiplications: some seconds at most."""


def build_mesh(source: str | PatchModel, angle: float, **accuracy: float) -> Mesh:
    model = lower_patches(source) if isinstance(source, str) else source
    options = MeshOptions(accuracy=Accuracy(angle_tolerance=angle, **accuracy))  # type: ignore[arg-type]
    goal = build_goal(options.accuracy, model)  # type: ignore[arg-type]
    mesh = build_mesher(model, options, Storage(), has_nodes=False).build_mesh(
        goal, MOST, Effort(WORK)
    )
    assert isinstance(mesh, Mesh)
    return mesh


example_mesh = cache(build_mesh)


# The most triangles that a mesh may take, at 0.5 and at 0.2 radians: a little more than it takes.
SMOOTH = {
    "sphere": (500, 2600),
    "octahedral-sphere": (500, 2800),
    "torus": (1000, 5300),
    "cylinder": (70, 200),
    "cone": (40, 100),
    "rounded-box": (600, 3200),
    "nurbs-goblet": (850, 6200),
    "bspline-ring": (1100, 5200),
    "bspline-hills": (200, 1100),
    "saddle": (100, 500),
    "monkey-saddle": (200, 1150),
    "bourke-1111": (100, 550),
}


@pytest.mark.slow
@pytest.mark.parametrize("example", SMOOTH)
def test_normals_turn_by_at_most_the_requested_angle(example: str) -> None:
    for angle, most in zip((0.5, 0.2), SMOOTH[example], strict=True):
        mesh = example_mesh(example, angle)
        check_sound(mesh)
        assert mesh.report.normal_angle is not None
        assert mesh.report.normal_angle <= angle
        assert mesh.report.triangles <= most


def test_members_of_a_group_are_divided_alike_along_a_straight_seam() -> None:
    """The seam is straight, so only the angles of normals divide it: those of the member that turns
    more. Both meshes have the same vertices on the seam."""
    rows = np.array([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]], [[2, 0, -2], [2, 1, 4.0]]])
    one, other = rows[:2], rows[1:]
    group = GroupSurface((Member(BezierSurface(one)), Member(BezierSurface(other))))
    options = MeshOptions(accuracy=Accuracy(angle_tolerance=0.05))
    begin, along = one[-1, 0], one[-1, -1] - one[-1, 0]
    vertices_on_seam = []
    model = group.lower()
    assert isinstance(model, GroupModel)
    for mesh in build_scene(model, options).meshes:
        # The vertices that are begin + t along, for some t.
        away = mesh.positions - begin
        t = away @ along / (along @ along)
        is_on_seam = np.linalg.norm(away - t[:, None] * along, axis=1) < 1e-12
        vertices_on_seam.append({*map(tuple, mesh.positions[is_on_seam].tolist())})
        assert mesh.report.normal_angle is not None
        assert mesh.report.normal_angle <= 0.05
    assert len(vertices_on_seam[0]) > 4
    assert vertices_on_seam[0] == vertices_on_seam[1]


@pytest.mark.parametrize("kind", ["fans", "rings"])
@pytest.mark.parametrize("seed", [1, 2])
def test_refinement_of_folded_patches_ends(kind: str, seed: int) -> None:
    """Nearly all of these models have folds, where no division makes angles smaller than 0.5.

    The number of triangles and the largest angle do not depend on the order of the patches.
    """
    whole = build_complex(kind, seed)
    order = range(len(whole.nets))
    one = build_mesh(whole.model(order), 0.5)
    assert one.report.triangles < 300 * len(whole.nets)
    other = build_mesh(whole.model(order[::-1]), 0.5)
    assert other.report.triangles == one.report.triangles
    assert other.report.normal_angle == one.report.normal_angle


@pytest.mark.parametrize("example", ["sphere", "saddle", "octahedral-sphere", "utah-teapot"])
def test_an_angle_that_needs_too_many_triangles_is_refused_at_once(example: str) -> None:
    model, effort = lower_patches(example), Effort(WORK)
    options = MeshOptions(accuracy=Accuracy(angle_tolerance=5e-324))  # the least float64 above 0
    goal = build_goal(options.accuracy, model)  # type: ignore[arg-type]
    with pytest.raises(TooLarge) as refused:
        build_mesher(model, options, Storage(), has_nodes=False).build_mesh(goal, MOST, effort)
    assert refused.value.issues[0].code == "too_many_triangles"
    assert effort.spent == 0
    # The estimate by which the request was refused is never above the number of triangles.
    for angle in (0.5, 0.2):
        assert estimate_least_triangles(model, angle) <= len(example_mesh(example, angle).triangles)
