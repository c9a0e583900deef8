"""Compact glTF (quantized, compressed) from surface to file: bounds, refusals and predictions."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from io import BytesIO
from typing import Any

import numpy as np
import pytest
import trimesh

from oracles.deviation import measure_surface_to_mesh
from oracles.gltf import Gltf, read_glb
from oracles.sheets import build_sheets
from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.engine.quantize import find_grid_error
from service.errors import InvalidRequest, UnsupportedByFormat
from service.pipeline.estimate import plan_estimate
from service.pipeline.mesh import plan_mesh, render
from service.pipeline.mesh_plan import build_plan, plan_sizes
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.patches import PatchSurface
from tests.strategies import Array

GLB = BY_NAME["glb"]
QUANTIZED = EncodeOptions(quantize=True)
COMPACT_OPTIONS = {
    "quantized": QUANTIZED,
    "compressed": EncodeOptions(compression="meshopt"),
    "both": EncodeOptions(quantize=True, compression="meshopt"),
}
each_compact_option = pytest.mark.parametrize(
    "encode", COMPACT_OPTIONS.values(), ids=COMPACT_OPTIONS.keys()
)
WAVES = np.array([[[i, j, (i * j) % 3] for j in range(4)] for i in range(4)], dtype=float)


def mesh_options(**accuracy: Any) -> MeshOptions:
    """Options of a mesh with this accuracy."""
    return MeshOptions(accuracy=Accuracy(**accuracy))


def read_corners(gltf: Gltf) -> Array:
    """Corners (T, 3, 3) of all triangles of a file, in model coordinates."""
    result = []
    for node in gltf.document["nodes"][1:]:  # all but the root
        (primitive,) = gltf.document["meshes"][node["mesh"]]["primitives"]
        if primitive["mode"] != 4:  # triangles
            continue
        stored = gltf.array(primitive["attributes"]["POSITION"]).astype(np.float64)
        points = stored * node.get("scale", [1.0] * 3) + node.get("translation", [0.0] * 3)
        result.append(points[gltf.array(primitive["indices"]).reshape(-1, 3)])
    return np.concatenate(result)


@pytest.mark.parametrize("options", [MeshOptions((5, 5)), mesh_options(relative_tolerance=0.01)])
def test_the_deviation_bound_includes_the_quantization_of_vertices(options: MeshOptions) -> None:
    surface = find("bourke-1111").surface()
    plain = plan_mesh(surface, options, GLB).run()
    response = plan_mesh(surface, options, GLB, COMPACT_OPTIONS["both"]).run()
    assert response.report is not None
    assert plain.report is not None
    gltf = read_glb(bytes(response.content))
    bound = gltf.document["asset"]["extras"]["report"]["deviation_bound"]
    assert bound == response.report.deviation_bound
    assert bound is not None
    assert bound != plain.report.deviation_bound
    result = measure_surface_to_mesh(build_sheets(surface.lower()), read_corners(gltf), 50)
    assert result.distance <= bound


@each_compact_option
@pytest.mark.parametrize("tolerance", [1e-2, 5e-4])
def test_the_deviation_bound_of_a_compact_file_is_within_the_tolerance(
    encode: EncodeOptions, tolerance: float
) -> None:
    response = plan_mesh(BezierSurface(WAVES), mesh_options(tolerance=tolerance), GLB, encode).run()
    assert response.report is not None
    assert response.report.deviation_bound is not None
    assert response.report.deviation_bound <= tolerance


def test_a_tolerance_below_twice_the_quantization_error_is_refused() -> None:
    surface = find("heated-panel").surface()
    grid_error = find_grid_error(surface.lower(), MeshOptions())
    options = mesh_options(tolerance=2.2 * grid_error)
    response = plan_mesh(surface, options, GLB, QUANTIZED).run()
    assert response.report is not None
    bound = response.report.deviation_bound
    assert bound is not None
    assert bound <= 2.2 * grid_error
    gltf = read_glb(bytes(response.content))
    result = measure_surface_to_mesh(build_sheets(surface.lower()), read_corners(gltf), 400)
    assert result.distance <= bound
    for tolerance in (1.9 * grid_error, 0.5 * grid_error):
        with pytest.raises(InvalidRequest) as refused:
            render(surface, mesh_options(tolerance=tolerance), GLB, QUANTIZED)
        assert [(i.code, i.pointer) for i in refused.value.issues] == [
            ("tolerance_too_small", "/tolerance")
        ]
        assert render(surface, mesh_options(tolerance=10 * tolerance), GLB, QUANTIZED)


@pytest.mark.slow
@each_compact_option
def test_a_budget_of_bytes_counts_the_bytes_of_the_compact_file(encode: EncodeOptions) -> None:
    surface, options = BezierSurface(WAVES), mesh_options(max_bytes=9_000)
    plain, compact = (
        plan_mesh(surface, options, GLB, each).run().report for each in (EncodeOptions(), encode)
    )
    assert len(plan_mesh(surface, options, GLB, encode).run().content) <= 9_000
    assert plain is not None
    assert compact is not None
    assert plain.deviation_bound is not None
    assert compact.deviation_bound is not None
    # More triangles fit into the same number of bytes.
    assert compact.triangles > 1.2 * plain.triangles
    assert compact.deviation_bound < plain.deviation_bound


@each_compact_option
@pytest.mark.parametrize("example", ["utah-teapot", "tea-service", "sphere", "trefoil-tube"])
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_compact_files_are_at_most_as_long_as_predicted(
    example: str, encode: EncodeOptions, suffix: str
) -> None:
    """The format bounds the length from the predicted counts."""
    fmt = BY_NAME[suffix]
    options = MeshOptions((6, 6), overlays=("control_net",), uvs=True)
    surface = find(example).surface()
    stored = build_plan(surface, options, fmt, encode).stored
    assert len(render(surface, options, fmt, encode)) <= fmt.byte_bound(stored, encode)


@pytest.mark.parametrize("options", [MeshOptions, partial(mesh_options, tolerance=0.1)])
def test_lines_of_a_surface_that_is_one_point_are_an_empty_file(
    options: Callable[[], MeshOptions],
) -> None:
    """Every side is a pole, so the boundary has no lines, and the grid no points."""
    point = BezierSurface(np.zeros((2, 2, 3)))
    lines = replace(options(), has_faces=False, overlays=("boundary",))
    document = read_glb(render(point, lines, GLB, QUANTIZED)).document
    assert "meshes" not in document
    assert document == read_glb(render(point, lines, GLB)).document


@pytest.mark.parametrize("example", ["sphere", "torus"])
def test_closed_surfaces_stay_closed_after_quantization(example: str) -> None:
    surface = find(example).surface()
    for options in (MeshOptions((12, 12)), mesh_options(relative_tolerance=2e-3)):
        content = render(surface, options, GLB, QUANTIZED)
        report = read_glb(content).document["asset"]["extras"]["report"]
        assert report["watertight"]
        # The report counts edges by indices; trimesh compares positions.
        loaded = trimesh.load_scene(BytesIO(content), file_type="glb", process=False).to_mesh()
        loaded.merge_vertices(merge_norm=True, merge_tex=True)
        assert loaded.is_watertight


@pytest.mark.parametrize("options", [MeshOptions((7, 7)), mesh_options(tolerance=0.02)])
def test_neighbours_in_two_quantized_files_share_the_vertices_of_their_edge(
    options: MeshOptions,
) -> None:
    """The grids of both files contain zero and have the same step."""
    left = np.array([[[i, j, (i + j * j) % 3] for j in range(4)] for i in range(4)]) / 0.7
    right = left * [1, 1, -0.7]
    right[:, :, 0] += left[-1, 0, 0]
    right[0] = left[-1]
    vertices_of_files = []
    for net in (left, right):
        corners = read_corners(read_glb(render(BezierSurface(net), options, GLB, QUANTIZED)))
        vertices_of_files.append({tuple(point) for point in corners.reshape(-1, 3).tolist()})
    # The two surfaces meet in a plane x = constant, which is not a multiple of the step.
    edge_x = max(point[0] for point in vertices_of_files[0])
    left_edge, right_edge = (
        {point for point in vertices if point[0] == edge_x} for vertices in vertices_of_files
    )
    assert len(left_edge) >= 8
    assert left_edge == right_edge


def test_triangles_that_collapse_on_the_grid_are_kept_and_the_mesh_is_closed() -> None:
    """The sphere is stretched to a needle whose width is smaller than the step of the grid."""
    surface = find("sphere").surface()
    assert isinstance(surface, PatchSurface)
    needle = replace(surface, vertices=surface.vertices * [1.0, 1e-6, 1e-6])
    response = plan_mesh(needle, MeshOptions((8, 8)), GLB, QUANTIZED).run()
    assert response.report is not None
    assert response.report.watertight
    corners = read_corners(read_glb(bytes(response.content)))
    assert len(corners) == response.report.triangles
    assert (corners[:, 0] == corners[:, 1]).all(axis=1).any()


@each_compact_option
@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_formats_without_a_compact_form_refuse_the_option(fmt: Any, encode: EncodeOptions) -> None:
    surface = find("saddle").surface()
    if fmt.compact:
        assert render(surface, MeshOptions((2, 2)), fmt, encode)
        return
    with pytest.raises(UnsupportedByFormat) as refused:
        render(surface, MeshOptions((2, 2)), fmt, encode)
    (issue,) = refused.value.issues
    name = "/quantize" if encode.quantize else "/compression"
    assert (issue.code, issue.pointer) == ("unsupported_by_format", name)


def test_compression_is_refused_if_the_library_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshopt, "is_available", lambda: False)
    plan_sizes.cache_clear()  # cached plans assume that the library is installed
    with pytest.raises(UnsupportedByFormat) as refused:
        render(find("saddle").surface(), MeshOptions((2, 2)), GLB, COMPACT_OPTIONS["compressed"])
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer) == ("compression_unavailable", "/compression")
    assert render(find("saddle").surface(), MeshOptions((2, 2)), GLB, QUANTIZED)


@pytest.mark.slow
@each_compact_option
@pytest.mark.parametrize(
    "options", [MeshOptions(), mesh_options(relative_tolerance=1e-3), mesh_options(max_bytes=9000)]
)
def test_an_estimate_of_a_compact_file_is_an_upper_bound(
    encode: EncodeOptions, options: MeshOptions
) -> None:
    surface = find("saddle").surface()
    result = json.loads(plan_estimate(surface, options, encode).run())
    assert set(result["bytes"]) == {"glb", "gltf"}
    others = [[fmt.name] for fmt in FORMATS if not fmt.compact]
    assert [refused["formats"] for refused in result["refused"]] == others
    for name, upper_bound in result["bytes"].items():
        assert len(render(surface, options, BY_NAME[name], encode)) <= upper_bound


def test_an_estimate_is_uncertain_if_quantization_may_exceed_the_tolerance() -> None:
    surface = find("cone").surface()
    grid_error = find_grid_error(surface.lower(), MeshOptions())
    fine, coarse = (
        mesh_options(tolerance=2.5 * grid_error),
        mesh_options(tolerance=100 * grid_error),
    )
    estimates = [
        json.loads(plan_estimate(surface, options, encode, formats=(GLB,)).run())
        for options, encode in ((fine, EncodeOptions()), (fine, QUANTIZED), (coarse, QUANTIZED))
    ]
    assert [estimate["certain"] for estimate in estimates] == [True, False, True]
    report = plan_mesh(surface, fine, GLB, QUANTIZED).run().report
    assert report is not None
    assert report.triangles <= estimates[1]["triangles"]
