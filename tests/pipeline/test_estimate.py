"""Estimates have the counts and bytes of a mesh, or upper bounds of them, and its refusals."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from oracles.gltf import read_glb
from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy, Camera
from service.engine.options import MeshOptions
from service.errors import Issue, SurfaceError
from service.pipeline.estimate import plan_estimate
from service.pipeline.limits import Limits
from service.pipeline.mesh import render
from service.pipeline.mesh_plan import PLAIN
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.member import Member
from tools.certify.surfaces import FAMILIES
from tools.examples import UNTRIMMED

COUNT_FIELDS = ("vertices", "triangles", "quads")

INEXACT = {"trefoil-tube", "ribbon", "hair"}
"""Examples that are sweeps along curves; their counts are bounds."""


def estimate_mesh(surface: Any, options: MeshOptions, *request: Any, **others: Any) -> Any:
    """The estimate for a surface, from its JSON."""
    return json.loads(plan_estimate(surface, options, *request, **others).run())


def select_issues(estimate: Any, fmt: Format) -> set[Issue]:
    """The issues with which an estimate says that a format is refused."""
    names = ("code", "detail", "pointer", "got", "needed")
    refused = (each for each in estimate["refused"] if fmt.name in each["formats"])
    return {Issue(*(each[name] for name in names)) for each in refused}


def assert_estimate_matches_files(
    surface: Any, options: MeshOptions, encode: EncodeOptions = PLAIN, limits: Limits | None = None
) -> Any:
    """The estimate for a surface, after comparing it with the files of all formats.

    For each format, the refusals are equal. Counts and bytes are equal if the estimate calls them
    exact, and otherwise not larger than estimated.
    """
    limits = limits or Limits()
    result = estimate_mesh(surface, options, encode, limits)
    file_count = 0
    for fmt in FORMATS:
        content, issues = try_render(surface, options, fmt, encode, limits)
        assert select_issues(result, fmt) == issues
        if issues:
            continue
        file_count += 1
        size = result["bytes"][fmt.name]
        assert len(content) <= size
        assert len(content) == size or fmt.name not in result["exact_bytes"]
        for report in read_reports(fmt, content):
            for name in COUNT_FIELDS:
                expected = result[name]
                assert report[name] == expected if result["exact"] else report[name] <= expected
    assert result["accepted"] == (file_count > 0)
    return result


def try_render(*request: Any) -> tuple[bytes, set[Issue]]:
    """The bytes of the file, or no bytes and the issues with which the service refuses."""
    try:
        return render(*request), set()
    except SurfaceError as error:
        return b"", set(error.issues)


def read_reports(fmt: Format, content: bytes) -> list[dict[str, Any]]:
    """The report in a file, in a list; the list is empty for formats without a report."""
    if fmt.name == "json":
        return [json.loads(content)["report"]]
    if fmt.name == "glb":
        return [read_glb(content).document["asset"]["extras"]["report"]]
    return []


QUADS = ("saddle", "cone", "octahedral-sphere", "trefoil-tube")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "faces"),
    [*((name, "triangles") for name in UNTRIMMED), *((name, "quads") for name in QUADS)],
)
def test_estimates_of_the_examples_match_their_files(example: str, faces: Any) -> None:
    result = assert_estimate_matches_files(
        find(example).surface(), MeshOptions((2, 3), faces=faces)
    )
    assert result["exact"] == (example not in INEXACT)
    # Only the bytes of an STL file follow from the number of triangles; it cannot store quads.
    assert result["exact_bytes"] == (["stl"] if result["exact"] and faces == "triangles" else [])


@pytest.mark.parametrize(
    "options",
    [
        {"weld": False},
        {"normals": False, "uvs": True},
        {"overlays": ("control_net", "boundary")},
        {"isocurves": (2, 2)},
        {"isocurves": (2, 2), "has_faces": False},
        {"overlays": ("boundary",), "has_faces": False},
        {"curvatures": True},
    ],
)
def test_estimates_with_an_option_match_the_files(options: dict[str, Any]) -> None:
    for example in ("cone", "octahedral-sphere"):
        assert assert_estimate_matches_files(
            find(example).surface(), MeshOptions((2, 2), **options)
        )["exact"]


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [None, Accuracy(relative_tolerance=0.05)])
def test_copies_stretched_in_different_ways_are_counted_as_separate_meshes(accuracy: Any) -> None:
    """With curvatures, copies with different stretching are separate meshes in glTF.

    Vertices where the curvature is discontinuous are stored twice: at the knots of these hills of
    degree 2.
    """
    # Fewer control points by tolerance, which takes longer.
    net = np.random.default_rng(2).normal(size=(9, 9, 3) if accuracy is None else (5, 4, 3))
    hills = BsplineSurface(net, (2, 2))
    members = (Member(hills), *(Member(hills, matrix=np.diag([k, 1, 1, 1.0])) for k in (2, 3)))
    options = MeshOptions((2, 2), curvatures=True, accuracy=accuracy)
    result = estimate_mesh(GroupSurface(members), options)
    plain = estimate_mesh(GroupSurface(members), replace(options, curvatures=False))
    for name, size in result["bytes"].items():
        plain_size = plain["bytes"][name]
        content, issues = try_render(GroupSurface(members), options, BY_NAME[name])
        assert not issues
        assert len(content) <= size
        if accuracy is None:
            stores_curvatures = "attribute" in BY_NAME[name].carries
            if name == "glb":
                assert size >= 2 * plain_size
            else:
                assert (size > plain_size) == stores_curvatures


@pytest.mark.parametrize("wires", ["tubes", "ribbons"])
def test_estimates_of_isocurves_as_tubes_or_ribbons_are_upper_bounds(wires: Any) -> None:
    result = assert_estimate_matches_files(
        find("cone").surface(), MeshOptions((3, 3), isocurves=(1, 2), wires=wires)
    )
    assert not result["exact"]


@pytest.mark.parametrize("form", ["cquad", "mesh", "off", "bez"])
def test_estimates_of_oogl_forms_match_the_files(form: Any) -> None:
    result = assert_estimate_matches_files(
        find("saddle").surface(), MeshOptions((4, 4)), EncodeOptions(form)
    )
    assert result["accepted"]


ACCURACIES = [
    Accuracy(tolerance=0.05),
    Accuracy(relative_tolerance=0.03, two_sided=True),
    Accuracy(tolerance=0.1, max_triangles=5000, max_bytes=1_000_000),
    Accuracy(max_triangles=300),
    Accuracy(max_bytes=30_000),
    Accuracy(angle_tolerance=0.5),
    Accuracy(camera=Camera((0, 0, 30), 0.8, 200), pixel_tolerance=1),
]


ISOCURVES: tuple[dict[str, Any], ...] = (
    {"isocurves": (3, 2)},
    {"isocurves": (2, 2), "wires": "tubes"},
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "accuracy", "isocurves"),
    [
        # To save time, each accuracy is tested with one of the two examples.
        *(("sphere", each, {}) for each in ACCURACIES[::2]),
        *(("torus", each, {}) for each in ACCURACIES[1::2]),
        *(
            ("torus", accuracy, isocurves)
            for accuracy in (Accuracy(tolerance=0.05), Accuracy(max_bytes=30_000))
            for isocurves in ISOCURVES
        ),
    ],
)
def test_estimates_by_tolerance_or_budget_are_upper_bounds(
    example: str, accuracy: Accuracy, isocurves: dict[str, Any]
) -> None:
    surface, options = find(example).surface(), MeshOptions(accuracy=accuracy, **isocurves)
    result = estimate_mesh(surface, options)
    assert not result["exact"]
    assert result["accepted"]
    for name in ("glb", "json"):
        content, issues = try_render(surface, options, BY_NAME[name])
        assert not (issues and result["certain"])
        assert len(content) <= result["bytes"][name]
        for report in read_reports(BY_NAME[name], content) if content else ():
            for count in COUNT_FIELDS:
                assert report[count] <= result[count]


@pytest.mark.slow
def test_estimates_by_tolerance_of_members_that_meet_are_upper_bounds() -> None:
    net = np.random.default_rng(1).normal(size=(4, 4, 3))
    net[0, :, 0] = 0  # the side u = 0 is in the plane of the mirror
    surface = BezierSurface(net)
    group = GroupSurface((Member(surface), Member(surface, matrix=np.diag([-1, 1, 1, 1.0]))))
    for tolerance in (0.1, 1e-3):
        options = MeshOptions(accuracy=Accuracy(tolerance=tolerance))
        assert not assert_estimate_matches_files(group, options)["exact"]


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_triangles_by_tolerance_are_at_most_half_of_the_estimate(name: str) -> None:
    """So an estimate may call a mesh certain although it counts only part of the proof."""
    surface = FAMILIES[name].surface(seed=1)
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=0.01), normals=False)
    result = estimate_mesh(surface, options)
    content, issues = try_render(surface, options, BY_NAME["json"])
    if issues:
        assert not result["certain"]
        return
    report = json.loads(content)["report"]
    assert 2 * report["triangles"] <= result["triangles"]
    assert report["vertices"] <= result["vertices"]


def test_an_estimate_is_certain_if_the_mesh_cannot_be_refused() -> None:
    surface = find("sphere").surface()

    def estimate(**accuracy: Any) -> Any:
        return estimate_mesh(surface, MeshOptions(accuracy=Accuracy(**accuracy)))

    assert estimate(tolerance=0.01)["certain"]
    assert not estimate(tolerance=1e-9)["certain"]
    # A budget may be too small. For budgets and angles, only the limits bound the triangles.
    assert not estimate(tolerance=0.01, max_triangles=200)["certain"]
    assert not estimate(tolerance=0.01, max_bytes=5000)["certain"]
    assert not estimate(max_triangles=200)["certain"]
    assert not estimate(angle_tolerance=0.1)["certain"]
    assert estimate(max_triangles=200)["triangles"] == 200
    assert estimate(max_bytes=5000)["bytes"]["glb"] == 5000
    # Curvatures at poles are costly, and poles are counted only during evaluation. With 16
    # divisions, the cost is within the limit even if all samples are poles.
    for divisions, is_certain in ((16, True), (200, False)):
        for curvatures in (True, False):
            options = MeshOptions((divisions, divisions), curvatures=curvatures)
            assert estimate_mesh(surface, options)["certain"] == (is_certain or not curvatures)
    assert estimate_mesh(surface, MeshOptions((200, 200), curvatures=True))["exact"]


def test_options_that_a_mesh_by_tolerance_excludes_are_refused() -> None:
    options = MeshOptions(accuracy=Accuracy(tolerance=0.1), faces="quads")
    result = assert_estimate_matches_files(find("saddle").surface(), options)
    assert not result["accepted"]
    assert {refused["code"] for refused in result["refused"]} == {"conflicting_options"}
    tube = assert_estimate_matches_files(
        find("trefoil-tube").surface(), MeshOptions(accuracy=Accuracy(tolerance=0.1))
    )
    assert tube["accepted"]
    assert not tube["certain"]


def test_triangles_of_copies_are_counted_each_and_stored_once_in_glb() -> None:
    teapot = find("utah-teapot").surface()
    group = GroupSurface(tuple(Member(teapot, f"{k}", None, None) for k in range(5)))
    teapot_estimate, group_estimate = (
        estimate_mesh(surface, MeshOptions((8, 8))) for surface in (teapot, group)
    )
    assert group_estimate["triangles"] == 5 * teapot_estimate["triangles"]
    sizes, group_sizes = teapot_estimate["bytes"], group_estimate["bytes"]
    assert group_sizes["glb"] < 2 * sizes["glb"]
    assert group_sizes["ply"] > 4.5 * sizes["ply"]
    assert_estimate_matches_files(group, MeshOptions((2, 2)))


def test_estimates_have_the_same_limits_as_meshes() -> None:
    surface = find("utah-teapot").surface()
    # By default the 32 patches of the teapot have 17 × 17 = 289 samples each, 9248 together.
    for limits in (
        Limits(max_vertices=9248),
        Limits(max_vertices=9247),
        Limits(max_bytes=900_000),
        Limits(max_bytes=1000),
    ):
        assert_estimate_matches_files(surface, MeshOptions(), limits=limits)


def test_an_estimate_of_a_refused_mesh_has_its_counts() -> None:
    result = estimate_mesh(find("saddle").surface(), MeshOptions((60_000, 60_000)))
    assert not result["accepted"]
    assert not result["exact"]
    assert result["vertices"] == 60_001**2
    (refused,) = result["refused"]
    assert refused["formats"] == list(BY_NAME)
    assert (refused["code"], refused["pointer"]) == ("too_many_vertices", "/resolution")
    # An STL file has a head of 84 bytes, and 50 bytes for each triangle.
    assert result["bytes"]["stl"] == 84 + 50 * 2 * 60_000**2


def test_the_json_object_has_bytes_and_refusals_by_format() -> None:
    surface, options = find("saddle").surface(), MeshOptions((2, 2), faces="quads")
    formats = [BY_NAME["stl"], BY_NAME["off"]]
    result = estimate_mesh(surface, options, formats=formats)
    assert list(result["bytes"]) == ["off"]
    assert (result["vertices"], result["triangles"], result["quads"]) == (9, 0, 4)
    assert (result["exact"], result["exact_bytes"], result["accepted"]) == (True, [], True)
    (refused,) = result["refused"]
    assert refused["formats"] == ["stl"]
    assert (refused["code"], refused["pointer"]) == ("unsupported_by_format", "/faces")
    assert set(refused) == {"formats", "code", "pointer", "detail", "got", "needed"}
