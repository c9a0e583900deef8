"""The built-in surfaces: their ids, their numbers, and that the quadrics are exact."""

import numpy as np
import pytest

from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from service.errors import UnknownSurface
from service.surface.colored import COLD, HOT
from service.surface.examples import EXAMPLES, find
from tests.examples import lower_patches
from tests.oracles import exact, quadrics, triangles

PATCHES = {
    "utah-teapot": (32, (3, 3)),
    "utah-teapot-original": (32, (3, 3)),
    "bourke-1111": (1, (5, 4)),
    "bourke-1111-colors": (1, (5, 4)),
    "tveit": (1, (3, 3)),
    "saddle": (1, (1, 1)),
    "heated-panel": (1, (2, 2)),
    "cylinder": (12, (2, 1)),
    "cone": (8, (2, 1)),
    "sphere": (8, (2, 2)),
    "torus": (16, (2, 2)),
    "monkey-saddle": (1, 3),
    "octahedral-sphere": (8, 4),
    "rounded-box": (18, (4, 4)),
    "bspline-hills": (20, (3, 3)),
    "nurbs-goblet": (44, (2, 3)),
    "bspline-ring": (60, (3, 3)),
}
OTHERS = {"rounded-box": [(8, 4)]}
"""Numbers of patches and degrees of further batches."""

ON = {
    ("cylinder", "side"): quadrics.cylinder,
    ("cone", "side"): quadrics.cone,
    ("sphere", "sphere"): quadrics.sphere,
    ("torus", "torus"): quadrics.torus,
}


def read_points(example: str) -> np.ndarray:
    """All patches of an example that lowers to one batch."""
    (batch,) = lower_patches(example).batches
    return batch.points


def test_each_has_an_id_and_a_description() -> None:
    """The id is the key; descriptions are sentences."""
    for key, example in EXAMPLES.items():
        assert example.id == key
        assert example.title
        assert example.description.endswith(".")


@pytest.mark.parametrize("example", PATCHES)
def test_numbers_of_patches(example: str) -> None:
    """The part names, the number and the degree of the patches."""
    model = lower_patches(example)
    batch = model.batches[0]
    assert (batch.count, batch.degree) == PATCHES[example]
    assert [(b.count, b.degree) for b in model.batches[1:]] == OTHERS.get(example, [])
    assert model.parts[0].first == 0
    assert model.parts[-1].last == model.patch_count
    assert model.name == example


def test_an_unknown_id_is_an_error_that_lists_the_known_ones() -> None:
    """The error does not repeat the requested id."""
    with pytest.raises(UnknownSurface) as caught:
        find("utah-kettle")
    (issue,) = caught.value.issues
    assert "utah-teapot" in issue.needed
    assert "kettle" not in str(issue)


def test_teapot_has_its_parts_and_stands_upright() -> None:
    """Six parts, z up, from the table at 0 to the knob at 3.15."""
    model = lower_patches("utah-teapot")
    sizes = [(part.name, part.last - part.first) for part in model.parts]
    assert sizes == [
        ("rim", 4),
        ("body", 8),
        ("handle", 4),
        ("spout", 4),
        ("lid", 8),
        ("bottom", 4),
    ]
    assert model.up == "z"
    points = read_points("utah-teapot")
    assert (points[..., 2].min(), points[..., 2].max()) == (0.0, 3.15)
    # Of Newell's 306 vertices 294 are distinct, and four of these are used by no patch.
    assert len(np.unique(points.reshape(-1, 3), axis=0)) == 290


def test_bourke_has_the_heights_of_the_c_library() -> None:
    """x = i, y = j, and z from random() seeded with 1111: its first and last numbers."""
    net = read_points("bourke-1111")[0]
    i, j = np.meshgrid(np.arange(6.0), np.arange(5.0), indexing="ij")
    np.testing.assert_array_equal(net[..., 0], i)
    np.testing.assert_array_equal(net[..., 1], j)
    assert net[0, 0, 2] == pytest.approx(-0.6152, abs=1e-15)
    assert net[5, 4, 2] == pytest.approx(0.4754, abs=1e-15)
    # (random() mod 10000)/5000 − 1: every height is a multiple of 1/5000.
    assert np.abs(net[..., 2] * 5000 - np.round(net[..., 2] * 5000)).max() < 1e-11
    assert np.abs(net[..., 2]).max() <= 1


def test_tveit_has_the_tutorials_normal_at_a() -> None:
    """DA × DC at A, normalised: (4, 2, 3)/√29."""
    normal = exact.normals(read_points("tveit")[0], None, (1, 1))[0, 0]
    np.testing.assert_allclose(normal, np.array([4, 2, 3]) / np.sqrt(29), atol=1e-15)


@pytest.mark.parametrize(("example", "part"), ON)
def test_quadrics_are_exact_and_look_outwards(example: str, part: str) -> None:
    """The exact points of the rational patches lie on the closed form, to the rounding of √½."""
    model = lower_patches(example)
    run = next(p for p in model.parts if p.name == part)
    (batch,) = model.batches
    assert batch.weights is not None
    for k in range(run.first, run.last):
        # An odd number of divisions, ends left out: no sample falls on a pole or an apex.
        inside = (slice(1, -1), slice(1, -1))
        points = exact.positions(batch.points[k], batch.weights[k], (5, 5))[inside].reshape(-1, 3)
        normals = exact.normals(batch.points[k], batch.weights[k], (5, 5))[inside].reshape(-1, 3)
        off, outward = ON[example, part](points)
        assert np.abs(off).max() < 4e-16
        assert np.abs(normals - outward).max() < 2e-15


def test_the_colored_surface_shows_its_height() -> None:
    """The colour is right at every vertex, not only at control points; the surface does not
    change."""
    built, plain = (
        tessellate(lower_patches(name), MeshOptions((8, 8)))
        for name in ("bourke-1111-colors", "bourke-1111")
    )
    np.testing.assert_array_equal(built.positions, plain.positions)
    assert built.colors is not None
    (batch,) = lower_patches("bourke-1111").batches
    low, high = batch.bounds[0][2], batch.bounds[1][2]
    share = (built.positions[:, 2:] - low) / (high - low)
    expected = (1 - share) * COLD + share * HOT
    np.testing.assert_allclose(built.colors, expected, atol=1e-15)


def test_the_heated_panel_is_hot_where_it_is_yellow() -> None:
    """Colours are a function of the temperature; texture coordinates are x and y in metres."""
    built = tessellate(lower_patches("heated-panel"), MeshOptions((16, 16)))
    ((name, temperature),) = built.attributes
    assert name == "temperature"
    assert temperature.min() == 20
    assert 50 < temperature.max() < 140
    assert built.colors is not None
    share = (temperature - 20) / 120
    np.testing.assert_allclose(built.colors, (1 - share) * COLD + share * HOT, atol=1e-15)
    assert built.uvs is not None
    np.testing.assert_allclose(built.uvs, built.positions[:, :2], atol=1e-15)


def test_the_monkey_saddle_is_its_polynomial() -> None:
    """z = x³ − 3xy² with three equal legs: exactly, except for the rounding of √3."""
    (net,) = read_points("monkey-saddle")
    points = triangles.positions(triangles.jets(net, None, 6))
    x, y, z = points.T
    assert np.abs(z - (x**3 - 3 * x * y**2)).max() < 5e-16
    assert triangles.normals(triangles.jets(net, None, 6))[:, 2].min() > 0


def test_the_rounded_box_is_smooth_all_over() -> None:
    """Each vertex of 24 flat places and of the seams has one normal, the exact one."""
    mesh = tessellate(lower_patches("rounded-box"), MeshOptions((6, 6)))
    assert mesh.normals is not None
    assert mesh.report.watertight
    assert len(mesh.positions) == mesh.report.vertices
    # The box without its rounding is the nearest place of every point, straight inwards.
    core = np.clip(mesh.positions, [-1, -0.7, -0.5], [1, 0.7, 0.5])
    assert np.abs(mesh.positions - core - 0.3 * mesh.normals).max() < 1e-14
