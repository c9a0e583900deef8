"""Meshes by angle, end to end: as measured in the mesh, and at what price."""

from math import pi

import numpy as np
import pytest

from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.aims import goal_of
from service.engine.adaptive.border import divide_border
from service.engine.adaptive.faces import SPAN
from service.engine.adaptive.goal import Goal
from service.engine.adaptive.ground import Ground
from service.engine.adaptive.limits import Effort
from service.engine.adaptive.meshing import meshing
from service.engine.adaptive.storage import Storage
from service.engine.mesh import Mesh
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.certify.models import complex_of
from tests.certify.surfaces import MODERATE, bicubic
from tests.engine.adaptive.bordering import bordered
from tests.engine.meshing import check_sound
from tests.examples import patches_of
from tests.strategies import Array, model_of

MOST, WORK = 30_000, 5e8
"""Of a request of this size nobody waits long; in work, some seconds at most."""


def made(source: str | PatchModel, angle: float, **accuracy: float) -> Mesh:
    model = patches_of(source) if isinstance(source, str) else source
    options = MeshOptions(accuracy=Accuracy(angle_tolerance=angle, **accuracy))  # type: ignore[arg-type]
    goal = goal_of(options.accuracy, model)  # type: ignore[arg-type]
    mesh = meshing(model, options, Storage(), nodes=False).made(goal, MOST, Effort(WORK))
    assert isinstance(mesh, Mesh)
    return mesh


# As many triangles as are allowed, at 0.5 and at 0.2 radians.
SMOOTH = {
    "sphere": (500, 2600),
    "octahedral-sphere": (500, 2800),
    "torus": (1000, 5300),
    "cylinder": (70, 200),
    "cone": (40, 100),
    "rounded-box": (600, 3200),
    "nurbs-goblet": (850, 6200),
    "bspline-hills": (200, 1100),
    "bspline-ring": (1100, 5200),
    "saddle": (90, 450),
    "monkey-saddle": (200, 1150),
    "bourke-1111": (100, 550),
    "tveit": (120, 480),
    "utah-teapot": (3700, 20_000),
}


@pytest.mark.parametrize("example", SMOOTH)
def test_normals_turn_no_more_than_was_asked_for(example: str) -> None:
    for angle, most in zip((0.5, 0.2), SMOOTH[example], strict=True):
        mesh = made(example, angle)
        check_sound(mesh)
        assert mesh.report.normal_angle is not None
        assert mesh.report.normal_angle <= 1.1 * angle
        assert mesh.report.triangles <= most


@pytest.mark.parametrize("seed", range(6))
def test_so_they_do_on_random_patches(seed: int) -> None:
    for angle, most in ((0.5, 250), (0.2, 1500)):
        mesh = made(model_of([bicubic(seed, MODERATE)]), angle)
        check_sound(mesh)
        assert mesh.report.normal_angle is not None
        assert mesh.report.normal_angle <= 1.1 * angle
        assert mesh.report.triangles <= most


def test_a_plane_is_two_triangles_at_any_angle() -> None:
    corners = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    mesh = made(model_of([corners]), 1e-3)
    assert (mesh.report.triangles, mesh.report.normal_angle) == (2, 0.0)


@pytest.mark.parametrize("kind", ["fans", "rings"])
@pytest.mark.parametrize("seed", [1, 2])
def test_folds_come_to_an_end(kind: str, seed: int) -> None:
    """Patches that lie over themselves: normals turn by π whatever is done, as is reported."""
    whole = complex_of(kind, seed)
    order = range(len(whole.nets))
    one = made(whole.model(order), 0.5)
    assert one.report.triangles < 300 * len(whole.nets)
    other = made(whole.model(order[::-1]), 0.5)
    assert other.report.triangles == one.report.triangles
    assert other.report.normal_angle == one.report.normal_angle


def test_a_tolerance_beside_it_holds_as_well() -> None:
    for tolerance in (0.05, 0.005):
        mesh = made("utah-teapot", 0.5, tolerance=tolerance)
        assert mesh.report.deviation_bound is not None
        assert mesh.report.deviation_bound <= tolerance
        assert mesh.report.normal_angle is not None
        assert mesh.report.normal_angle <= 0.55
    fine = made("utah-teapot", pi, tolerance=0.005)
    assert fine.report.triangles <= mesh.report.triangles


def test_a_limit_refuses_at_once() -> None:
    model = patches_of("utah-teapot")
    goal = Goal(np.inf, 0.01)
    options = MeshOptions(accuracy=Accuracy(angle_tolerance=0.01))
    with pytest.raises(TooLarge):
        meshing(model, options, Storage(), nodes=False).made(goal, 1000, Effort(WORK / 100))


def twisted(count: int) -> Array:
    """Nets of neighbours along u, straight in both directions: z = x y on [0, n] × [−1, 1]."""
    return np.array(
        [[[[x, y, 0.5 * x * y] for y in (-1.0, 1.0)] for x in (k, k + 1.0)] for k in range(count)]
    )


def test_straight_edges_of_twisted_patches_are_divided() -> None:
    """Where the normals of the patches beside them turn, the same for both, whoever comes first."""
    nets = list(twisted(3))
    for order in ([0, 1, 2], [2, 0, 1]):
        model = model_of([nets[k] for k in order])
        found = bordered(model, Goal(np.inf))
        border = divide_border(found.faces, found.seams, Goal(np.inf, 0.2), 1000, Ground.of(model))
        for face, k in enumerate(order):
            for side in range(4):
                rows = slice(*border.start[4 * face + side :][:2])
                points = border.points[border.vertex[rows]]
                slopes = np.stack([-0.5 * points[:, 1], -0.5 * points[:, 0], 0 * points[:, 0] + 1])
                unit = slopes / np.linalg.norm(slopes, axis=0)
                cosine = (unit[:, 1:] * unit[:, :-1]).sum(axis=0)
                assert np.arccos(cosine).max() <= 0.2
                # Halves would not do: twice as long, they would turn further somewhere.
                assert len(points) <= 2 + 2 * np.arccos(unit[:, 0] @ unit[:, -1]) / 0.2
            assert points[0, 0] == k


def test_a_side_of_many_spans_is_cut_at_its_knots() -> None:
    """Straight, but twisted: the first cut is at the middle knot, and flat spans stay together."""
    u, v = np.meshgrid(np.arange(11.0), [0.0, 1.0], indexing="ij")
    net = np.stack([u, v, np.where(u > 5, u - 5, 0) * 0.3 * v], axis=-1)
    model = BsplineSurface(net, (1, 1), ("clamped", "clamped")).lower()
    found = bordered(model, Goal(np.inf))
    border = divide_border(found.faces, found.seams, Goal(np.inf, 0.3), 1000, Ground.of(model))
    at = border.at[slice(*border.start[2:4])]
    assert at[0] == 0
    assert at[-1] == 10 * SPAN
    assert at[1] == 5 * SPAN
    assert len(at) > 4
