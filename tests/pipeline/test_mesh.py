"""Meshes from surface to file: results, refusals, and how little memory a refusal needs."""

import tracemalloc
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import build_sheets
from service.encoders.format import EncodeOptions, Format, OoglForm
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MAX_RESOLUTION, Faces, MeshOptions
from service.engine.points.places import PointsQuery
from service.errors import InvalidRequest, SurfaceError, TooLarge, UnsupportedByFormat
from service.pipeline.checks import check_model
from service.pipeline.limits import Limits
from service.pipeline.mesh import build_mesh, plan_mesh, render
from service.pipeline.mesh_counts import count_models, mesh_counts, mesh_size
from service.pipeline.mesh_plan import build_plan, plan_sizes
from service.pipeline.queries import plan_points
from service.surface.batches import ChannelKind
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.curve import BezierCurve
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.sizes import SurfaceSize
from service.surface.sweeps import TubeSurface
from tests.strategies import Array, build_model, resolutions, split_models
from tools.examples import lower_patches

each_format = pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
MEBIBYTE = 1 << 20


@each_format
def test_meshes_have_the_precision_that_the_format_stores(fmt: Format) -> None:
    """Positions are float32 for formats that store float32, and float64 for the others."""
    expected = build_mesh(lower_patches("tveit"), MeshOptions(), fmt)
    assert expected.positions.dtype == (np.float32 if fmt.is_float32 else np.float64)


faces: st.SearchStrategy[Faces] = st.sampled_from(["triangles", "quads"])


@given(split_models(oriented=False), resolutions, faces, st.booleans())
def test_predicted_counts_are_upper_bounds(
    net_and_pieces: tuple[Array, list[Array]],
    resolution: tuple[int, int],
    kind: Faces,
    weld: bool,
) -> None:
    """The predicted counts need only the size of the surface, not how its patches are joined."""
    _, pieces = net_and_pieces
    options = MeshOptions(resolution=resolution, faces=kind, weld=weld, uvs=True)
    distinct_counts, all_counts = count_models(build_model(pieces), options)
    assert distinct_counts == all_counts  # they differ only for groups, whose members may be equal
    # The first three numbers are vertices, triangles and quads.
    predicted = astuple(mesh_counts(SurfaceSize((3, 3), grids=len(pieces)), options))[:3]
    assert all(a >= b for a, b in zip(predicted, astuple(all_counts), strict=True))


@each_format
@pytest.mark.parametrize("option", [{"faces": "quads"}, {"overlays": ("control_net",)}], ids=str)
def test_meshes_that_a_format_cannot_store_are_refused(
    fmt: Format, option: dict[str, object]
) -> None:
    """The issue has the pointer of the option; formats that store quads or lines accept them."""
    surface = find("tveit").surface()
    options = MeshOptions(**option)  # type: ignore[arg-type]
    (name,) = option
    is_supported = fmt.has_quads if name == "faces" else fmt.has_overlays
    if is_supported:
        assert render(surface, options, fmt)
        return
    with pytest.raises(UnsupportedByFormat) as caught:
        render(surface, options, fmt)
    (issue,) = caught.value.issues
    assert issue.pointer == f"/{name}"
    assert fmt.name in issue.message


def get_refusal(options: MeshOptions, fmt: Format, limits: Limits) -> SurfaceError:
    """The refusal of a mesh of the teapot; fails if it allocates 2 MiB, as the mesh would."""
    surface = find("utah-teapot").surface()
    tracemalloc.start()
    try:
        with pytest.raises(TooLarge) as caught:
            render(surface, options, fmt, limits=limits)
        assert tracemalloc.get_traced_memory()[1] < 2 * MEBIBYTE
    finally:
        tracemalloc.stop()
    return caught.value


@each_format
@pytest.mark.parametrize("resolution", [(400, 400), (MAX_RESOLUTION,) * 2, (3, MAX_RESOLUTION)])
def test_too_many_vertices_are_refused_before_anything_is_computed(
    fmt: Format, resolution: tuple[int, int]
) -> None:
    """The mesh is refused because of the shape of the net and the resolution."""
    (issue,) = get_refusal(MeshOptions(resolution=resolution), fmt, Limits()).issues
    assert (issue.code, issue.pointer) == ("too_many_vertices", "/resolution")
    assert str(Limits().max_vertices) in issue.needed


@each_format
def test_too_many_bytes_are_refused_before_anything_is_computed(fmt: Format) -> None:
    """The number of bytes is predicted for the format of the response."""
    options, limits = MeshOptions(resolution=(64, 64)), Limits(max_bytes=50_000)
    (issue,) = get_refusal(options, fmt, limits).issues
    assert issue.code == "too_many_bytes"
    assert "50000" in issue.needed


@each_format
def test_a_cached_plan_equals_a_new_plan(fmt: Format) -> None:
    for name in ("saddle", "utah-teapot"):
        surface = find(name).surface()
        size, file_options, limits = surface.size(), (fmt, EncodeOptions()), Limits()
        for _ in range(2):
            plan = build_plan(surface, MeshOptions((3, 3)), *file_options, limits)
            # The function without its cache. It needs two sizes: with all members of a group, and
            # with equal members once. These surfaces are no groups, so the two are equal.
            expected = plan_sizes.__wrapped__(size, size, MeshOptions((3, 3)), file_options, limits)
            assert plan == expected
            # With 3 × 3 divisions, a patch has 16 vertices.
            with pytest.raises(TooLarge):
                plan_mesh(surface, MeshOptions((3, 3)), *file_options, Limits(max_vertices=15))


def test_a_mesh_exactly_at_the_limits_is_accepted() -> None:
    """A limit smaller by one vertex or one byte refuses the mesh."""
    surface, options, fmt = find("tveit").surface(), MeshOptions(resolution=(9, 9)), BY_NAME["stl"]
    size = mesh_size(surface.size(), options, fmt)
    limits = Limits(size.vertices, fmt.byte_bound(size, EncodeOptions()))
    assert render(surface, options, fmt, limits=limits)
    for smaller_limits in (
        replace(limits, max_vertices=limits.max_vertices - 1),
        replace(limits, max_bytes=limits.max_bytes - 1),
    ):
        with pytest.raises(TooLarge):
            render(surface, options, fmt, limits=smaller_limits)


def test_the_bez_form_of_oogl_does_not_depend_on_the_resolution() -> None:
    """The form `bez` stores the control points of the patches in place of a mesh."""
    surface, oogl = find("utah-teapot").surface(), BY_NAME["oogl"]
    coarse, fine = (
        render(surface, MeshOptions(resolution=(r, r)), oogl, EncodeOptions("bez")) for r in (2, 9)
    )
    assert coarse == fine


def test_patches_of_a_degree_above_12_are_refused_in_the_bez_form() -> None:
    """Geomview, which reads OOGL, supports degrees up to 12; meshes have no such limit."""
    surface = BezierSurface(np.random.default_rng(1).random((14, 3, 3)))
    with pytest.raises(UnsupportedByFormat):
        render(surface, MeshOptions(), BY_NAME["oogl"], EncodeOptions("bez"))
    assert render(surface, MeshOptions(), BY_NAME["oogl"])


CHANNELS: tuple[ChannelKind, ...] = ("colors", "uvs", "attribute")


@each_format
@pytest.mark.parametrize("kind", CHANNELS)
def test_channels_that_a_format_cannot_store_are_dropped(fmt: Format, kind: ChannelKind) -> None:
    """Then a surface without the channel has the same file and the same predicted size."""
    surface = find("heated-panel").surface()
    assert isinstance(surface, BezierSurface)
    remaining_channels = {
        "colors": replace(surface.channels, colors=None),
        "uvs": replace(surface.channels, uvs=None),
        "attribute": replace(surface.channels, attributes=()),
    }
    reduced_surface = replace(surface, channels=remaining_channels[kind])
    request, reduced_request = (
        (each, MeshOptions((3, 3)), fmt, EncodeOptions(oogl="off"))
        for each in (surface, reduced_surface)
    )
    is_equal_file = render(*request) == render(*reduced_request)
    assert is_equal_file == (kind not in fmt.carries)
    if is_equal_file:
        assert build_plan(*request).size == build_plan(*reduced_request).size


def test_forward_differences_of_high_degree_are_refused() -> None:
    """Rounding errors limit the degree to 8 for formats with float32, to 16 with float64."""
    for columns, refusing_formats in (
        (9, ()),
        (10, ("glb",)),
        (17, ("glb",)),
        (18, ("glb", "json")),
    ):
        surface = BezierSurface(np.random.default_rng(1).random((2, columns, 3)))
        options = MeshOptions((2, 3), method="forward_difference")
        for name in ("glb", "json"):
            if name in refusing_formats:
                with pytest.raises(InvalidRequest) as caught:
                    plan_mesh(surface, options, BY_NAME[name])
                assert caught.value.issues[0].pointer == "/method"
                assert caught.value.issues[0].got == f"degree {columns - 1}"
            else:
                assert render(surface, options, BY_NAME[name])


def test_de_casteljau_is_refused_if_it_would_take_minutes() -> None:
    """A mesh of 4 million vertices is accepted for degree 3 and refused for degree 64."""
    options = MeshOptions((2000, 2000), method="de_casteljau")
    cubic, high = (BezierSurface(np.ones((n + 1, n + 1, 3))) for n in (3, 64))
    check_model(cubic.lower(), options, Limits())
    assert build_plan(cubic, options, BY_NAME["glb"]).size.vertices == 2001**2
    assert (
        build_plan(high, replace(options, method="matrix"), BY_NAME["glb"]).size.vertices == 2001**2
    )
    for surface in (high, GroupSurface((Member(high),))):
        with pytest.raises(TooLarge) as caught:
            plan_mesh(surface, options, BY_NAME["glb"]).run()
        assert caught.value.issues[0].code == "too_costly"
        assert caught.value.issues[0].pointer == "/method"


def test_points_are_refused_if_normals_at_poles_would_take_minutes() -> None:
    """The service estimates the time as if every point were a pole, at which normals are limits."""
    uv = np.random.default_rng(2).random((200_000, 2))
    cubic, high = (BezierSurface(np.ones((n + 1, n + 1, 3))) for n in (3, 64))
    for surface, order in ((cubic, 0), (cubic, 2), (high, 0)):
        plan_points(surface, PointsQuery(uv[:10], None, order)).run()
        assert plan_points(surface, PointsQuery(uv, None, order)).cost.seconds > 0
    with pytest.raises(TooLarge) as caught:
        plan_points(high, PointsQuery(uv, None, 1)).run()
    assert caught.value.issues[0].code == "too_costly"
    assert caught.value.issues[0].pointer == "/uv"


def test_points_are_refused_if_curvatures_near_poles_would_take_minutes() -> None:
    """Near a pole curvatures are computed from series, which takes 10 times as long or more."""
    net = np.random.default_rng(3).random((4, 4, 3))
    net[0] = 0.0  # the side u = 0 is a pole
    surface = BezierSurface(net, np.random.default_rng(4).uniform(0.2, 5, (4, 4)))
    uv = np.random.default_rng(2).random((200_000, 2))
    near_pole = uv * (1e-4, 1)
    for places, order in ((uv, 2), (near_pole, 1), (near_pole[:10_000], 2)):
        plan_points(surface, PointsQuery(places, None, order))
    triangle = TriangleSurface(np.concatenate([net[k, : 4 - k] for k in range(4)]))
    # The pole of the triangle is the side t = 0 of the barycentric coordinates (r, s, t).
    on_pole = np.column_stack([uv[:, 0], 1 - uv[:, 0], 0 * uv[:, 0]])
    far_from_pole = on_pole[:, ::-1] * 0.5 + 0.5 / 3  # t is at least 1/6
    plan_points(triangle, PointsQuery(far_from_pole, None, 2))
    for refused_surface, places in ((surface, near_pole), (triangle, on_pole)):
        with pytest.raises(TooLarge) as caught:
            plan_points(refused_surface, PointsQuery(places, None, 2)).run()
        assert caught.value.issues[0].code == "too_costly"


def test_evaluation_methods_are_refused_for_sweeps() -> None:
    """Sweeps have a method of their own; this also holds for sweeps in a group."""
    curve = BezierCurve(np.array([[0.0, 0, 0], [1, 1, 0], [2, 0, 1]]))
    tube = TubeSurface(curve, np.array([0.1]))
    for surface in (tube, GroupSurface((Member(find("saddle").surface()), Member(tube)))):
        assert render(surface, MeshOptions((2, 2)), BY_NAME["glb"])
        with pytest.raises(InvalidRequest) as caught:
            plan_mesh(surface, MeshOptions((2, 2), method="de_casteljau"), BY_NAME["glb"])
        issue = caught.value.issues[0]
        assert (issue.code, issue.pointer) == ("not_parametric", "/method")


def test_the_deviation_bound_includes_rounding_to_the_six_digits_of_oogl() -> None:
    # So far from zero, rounding to six digits moves vertices by more than the mesh deviates.
    net = np.array([[[i, j, i * j % 3] for j in range(3)] for i in range(3)], dtype=float)
    surface = BezierSurface(net * 0.01 + [123.0, -9.9999, 1234.5])
    options = MeshOptions(resolution=(16, 16), faces="quads", normals=False, uvs=False)
    bounds: dict[OoglForm | None, float] = {}
    files: dict[OoglForm | None, bytes] = {}
    forms: list[OoglForm | None] = [None, "cquad", "mesh", "off"]
    for form in forms:
        response = plan_mesh(surface, options, BY_NAME["oogl"], EncodeOptions(form)).run()
        assert response.report is not None
        assert response.report.deviation_bound is not None
        bounds[form], files[form] = response.report.deviation_bound, bytes(response.content)
    exact = build_mesh(surface.lower(), options, BY_NAME["oogl"]).report.deviation_bound
    # The forms `mesh` and `off` have all digits. Without a form, OOGL files are `cquad`.
    assert bounds["mesh"] == bounds["off"] == exact
    assert files[None] == files["cquad"]
    assert bounds[None] == bounds["cquad"]
    lines = [line.split() for line in files["cquad"].decode("ascii").splitlines()]
    # A line of a vertex has its three coordinates and a colour of four numbers.
    points = np.array([[float(x) for x in line[:3]] for line in lines if len(line) == 7])
    quads = points.reshape(-1, 4, 3)
    for halves in ([0, 1, 2], [0, 2, 3]), ([1, 2, 3], [1, 3, 0]):  # either diagonal
        triangles = np.concatenate([quads[:, half] for half in halves])
        result = measure_surface_to_mesh(build_sheets(surface), triangles).distance
        assert bounds["off"] < result <= bounds["cquad"] < 3 * result
