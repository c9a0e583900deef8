"""The built-in surfaces: their ids, patches and values, and the closed forms that they equal."""

import numpy as np
import pytest

from oracles import exact, quadrics, triangles
from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from service.errors import UnknownSurface
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.examples.patches import COLD, HOT
from tools.examples import lower_patches

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
"""Number of patches and degree of the first batch of examples, without sweeps, groups and
multipatches."""
OTHER_BATCHES = {"rounded-box": [(8, 4)]}
"""Numbers of patches and degrees of further batches."""

CLOSED_FORMS = {
    ("cylinder", "side"): quadrics.cylinder,
    ("cone", "side"): quadrics.cone,
    ("sphere", "sphere"): quadrics.sphere,
    ("torus", "torus"): quadrics.torus,
}
"""For parts of examples, functions of points: the residuals of the closed form, and the outward
normals."""


def read_points(example: str) -> np.ndarray:
    """Control points of all patches of an example that is lowered to one batch."""
    (batch,) = lower_patches(example).batches
    return batch.points


def test_each_example_has_an_id_a_title_and_a_description() -> None:
    """The id equals the key in `EXAMPLES`; the description ends with a full stop."""
    for key, example in EXAMPLES.items():
        assert example.id == key
        assert example.title
        assert example.description.endswith(".")


@pytest.mark.parametrize("example", PATCHES)
def test_examples_have_their_number_of_patches_and_degree(example: str) -> None:
    """The parts contain all patches, without gap or overlap."""
    model = lower_patches(example)
    batch = model.batches[0]
    assert (batch.count, batch.degree) == PATCHES[example]
    assert [(b.count, b.degree) for b in model.batches[1:]] == OTHER_BATCHES.get(example, [])
    ends = [0, *(part.last for part in model.parts)]
    assert [part.first for part in model.parts] == ends[:-1]
    assert ends[-1] == model.patch_count
    assert model.name == example


def test_the_error_for_an_unknown_id_lists_the_ids() -> None:
    """The error does not repeat the requested id."""
    with pytest.raises(UnknownSurface) as caught:
        find("utah-kettle")
    (issue,) = caught.value.issues
    assert "utah-teapot" in issue.needed
    assert "kettle" not in str(issue)


def test_the_teapot_has_six_parts_and_the_right_height() -> None:
    """z is up; the bottom is at z = 0 and the top of the knob at z = 3.15."""
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
    # 294 of Newell's 306 vertices are distinct, and four of these 294 are in no patch.
    assert len(np.unique(points.reshape(-1, 3), axis=0)) == 290


def test_the_bourke_surface_has_the_heights_that_random_of_the_c_library_gives() -> None:
    """x = i, y = j, and z is from random() with seed 1111; the first and the last are compared."""
    net = read_points("bourke-1111")[0]
    i, j = np.meshgrid(np.arange(6.0), np.arange(5.0), indexing="ij")
    np.testing.assert_array_equal(net[..., 0], i)
    np.testing.assert_array_equal(net[..., 1], j)
    assert net[0, 0, 2] == pytest.approx(-0.6152, abs=1e-15)
    assert net[5, 4, 2] == pytest.approx(0.4754, abs=1e-15)
    # The heights are (random() mod 10000)/5000 − 1, so every height is a multiple of 1/5000.
    assert np.abs(net[..., 2] * 5000 - np.round(net[..., 2] * 5000)).max() < 1e-11
    assert np.abs(net[..., 2]).max() <= 1


def test_the_tveit_surface_has_the_normal_of_the_tutorial_at_corner_a() -> None:
    """Corner A is control point (0, 0); the two edges of the net there are normal to (4, 2, 3)."""
    normal = exact.normals(read_points("tveit")[0], None, (1, 1))[0, 0]
    np.testing.assert_allclose(normal, np.array([4, 2, 3]) / np.sqrt(29), atol=1e-15)


@pytest.mark.parametrize(("example", "part"), CLOSED_FORMS)
def test_patches_of_quadrics_lie_on_them_and_have_outward_normals(example: str, part: str) -> None:
    """The points satisfy the closed form up to the rounding of the weight √½."""
    model = lower_patches(example)
    part_run = next(p for p in model.parts if p.name == part)
    (batch,) = model.batches
    assert batch.weights is not None
    for k in range(part_run.first, part_run.last):
        # Poles and the apex of the cone are on borders of patches, so no inner sample is there.
        inner = (slice(1, -1), slice(1, -1))
        points = exact.positions(batch.points[k], batch.weights[k], (5, 5))[inner].reshape(-1, 3)
        normals = exact.normals(batch.points[k], batch.weights[k], (5, 5))[inner].reshape(-1, 3)
        residuals, expected_normals = CLOSED_FORMS[example, part](points)
        assert np.abs(residuals).max() < 4e-16
        assert np.abs(normals - expected_normals).max() < 2e-15


def test_the_colored_surface_shows_its_height() -> None:
    """Colours depend linearly on z at every vertex; the surface without colours is the same."""
    mesh, plain = (
        tessellate(lower_patches(name), MeshOptions((8, 8)))
        for name in ("bourke-1111-colors", "bourke-1111")
    )
    np.testing.assert_array_equal(mesh.positions, plain.positions)
    assert mesh.colors is not None
    (batch,) = lower_patches("bourke-1111").batches
    low, high = batch.bounds[0][2], batch.bounds[1][2]
    share = (mesh.positions[:, 2:] - low) / (high - low)
    expected = (1 - share) * COLD + share * HOT
    np.testing.assert_allclose(mesh.colors, expected, atol=1e-15)


def test_colors_of_the_heated_panel_depend_on_its_temperature() -> None:
    """Colours are a linear function of the temperature; texture coordinates are x and y."""
    mesh = tessellate(lower_patches("heated-panel"), MeshOptions((16, 16)))
    ((name, temperature),) = mesh.attributes
    assert name == "temperature"
    assert temperature.min() == 20
    # The control values are from 20 to 140, and have the colours from COLD to HOT.
    assert 50 < temperature.max() < 140
    assert mesh.colors is not None
    share = (temperature - 20) / 120
    np.testing.assert_allclose(mesh.colors, (1 - share) * COLD + share * HOT, atol=1e-15)
    assert mesh.uvs is not None
    np.testing.assert_allclose(mesh.uvs, mesh.positions[:, :2], atol=1e-15)


def test_the_monkey_saddle_satisfies_its_polynomial() -> None:
    """z = x³ − 3xy² at all samples, up to the rounding of √3 in the control points."""
    (net,) = read_points("monkey-saddle")
    points = triangles.positions(triangles.jets(net, None, 6))
    x, y, z = points.T
    assert np.abs(z - (x**3 - 3 * x * y**2)).max() < 5e-16
    assert triangles.normals(triangles.jets(net, None, 6))[:, 2].min() > 0


def test_the_rounded_box_is_smooth_everywhere() -> None:
    """Every vertex has one normal, also on the seams: the exact normal of a rounded box."""
    mesh = tessellate(lower_patches("rounded-box"), MeshOptions((6, 6)))
    assert mesh.normals is not None
    assert mesh.report.watertight
    assert len(mesh.positions) == mesh.report.vertices
    # A point of the surface is 0.3 away, along its normal, from the nearest point of an inner box.
    core = np.clip(mesh.positions, [-1, -0.7, -0.5], [1, 0.7, 0.5])
    assert np.abs(mesh.positions - core - 0.3 * mesh.normals).max() < 1e-14
