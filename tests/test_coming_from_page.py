"""The page docs/coming-from.md: its requests run, and its programs read libraries as they are."""

import json
import subprocess
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geomdl import NURBS, exchange

from service.pipeline.calls import CALLS, JSON, CallLimits
from service.schemas.queries import PointsRequest
from service.schemas.validation import validate_document
from tests.test_readme import SERVED_AT, Block, find_blocks, round_numbers, run_shell
from tools.programs import find_program

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docs" / "coming-from.md").read_text(encoding="utf-8")
BLOCKS = find_blocks(TEXT)
REQUESTS = [block for block in BLOCKS if block.language == "sh"]
OUTPUTS = {
    request.text: output
    for request, output in pairwise(BLOCKS)
    if request.language == "sh" and output.language in ("json", "text")
}
PROGRAMS: dict[str, Any] = {}
for each in BLOCKS:
    if each.language == "python":
        exec(compile(each.text, "coming-from.md", "exec"), PROGRAMS)

BEGINNINGS = {".glb": b"glTF", ".vtu": b"<?xml", ".stl": b""}
"""The first bytes of the files that requests write."""

KNOTS_U: list[float] = [0, 0, 0, 0.5, 1, 1, 1]
KNOTS_V: list[float] = [0, 0, 1, 2, 2]
UV = np.array([[0, 0], [0.1, 1.7], [0.5, 1], [0.8, 0.3], [1, 2]])


def build_peer() -> Any:
    """A surface of geomdl with random points and weights, 4 × 3, of degree (2, 1)."""
    rng = np.random.default_rng(4)
    weights = rng.uniform(0.5, 2, (12, 1))
    surface = NURBS.Surface(normalize_kv=False)
    surface.degree_u, surface.degree_v = 2, 1
    surface.set_ctrlpts(np.hstack((rng.normal(size=(12, 3)) * weights, weights)).tolist(), 4, 3)
    surface.knotvector_u, surface.knotvector_v = KNOTS_U, KNOTS_V
    return surface


PEER = build_peer()
NET, WEIGHTS = np.reshape(PEER.ctrlpts, (4, 3, 3)), np.reshape(PEER.weights, (4, 3))


def evaluate(surface: dict[str, Any], uv: Any = UV) -> Any:
    """The points of a surface, computed by the service."""
    request = validate_document(PointsRequest, {"surface": surface, "uv": np.asarray(uv).tolist()})
    content = CALLS["/v1/points"].plan(request, JSON, CallLimits()).run().content
    return np.array(json.loads(bytes(content))["positions"])


def check(surface: dict[str, Any]) -> None:
    """The surface is that of geomdl."""
    np.testing.assert_allclose(evaluate(surface), PEER.evaluate_list(UV.tolist()), atol=1e-14)


def test_each_program_has_a_request() -> None:
    sections = TEXT.split("\n## ")[1:]
    names = [section.split("\n")[0] for section in sections]
    assert names[:7] == ["geomdl", "Rhino", "splinepy", "G+Smo", "VTK", "OpenSCAD", "three.js"]
    assert all("```sh" in section for section in sections)


@pytest.mark.parametrize("request_", REQUESTS, ids=[f"{n}" for n in range(len(REQUESTS))])
def test_requests_get_the_responses_that_the_page_shows(
    request_: Block, server: str, tmp_path: Path
) -> None:
    find_program("curl")
    exchange.export_json(PEER, str(tmp_path / "arc.json"))
    response = run_shell(request_.text.replace(SERVED_AT, server), tmp_path)
    output = OUTPUTS.get(request_.text)
    if output is None:
        (path,) = [path for path in tmp_path.iterdir() if path.name != "arc.json"]
        assert path.read_bytes().startswith(BEGINNINGS[path.suffix])
        assert not path.read_bytes().startswith(b"{")
    elif output.language == "json":
        assert round_numbers(response) == round_numbers(output.text)
    else:
        assert response == output.text


def test_surfaces_of_geomdl_become_requests() -> None:
    check(PROGRAMS["from_geomdl"](PEER))


def test_surfaces_of_rhino_become_requests() -> None:
    rhino3dm = pytest.importorskip("rhino3dm")
    sphere = rhino3dm.Sphere(rhino3dm.Point3d(0, 0, 0), 2.0).ToNurbsSurface()
    uv = [[0.3, -1], [2, 0.5], [5, 1.2]]
    expected = [sphere.PointAt(u, v) for u, v in uv]
    points = evaluate(PROGRAMS["from_rhino"](sphere), uv)
    np.testing.assert_allclose(points, [[p.X, p.Y, p.Z] for p in expected], atol=1e-14)


def test_splines_of_splinepy_become_requests() -> None:
    spline = SimpleNamespace(
        control_mesh_resolutions=np.array([4, 3]),
        degrees=np.array([2, 1]),
        knot_vectors=[KNOTS_U, KNOTS_V],
        control_points=NET.swapaxes(0, 1).reshape(-1, 3),
        weights=WEIGHTS.T.reshape(-1, 1),
    )
    check(PROGRAMS["from_splinepy"](spline))
    spline.weights = None
    assert "weights" not in PROGRAMS["from_splinepy"](spline)


def test_geometries_of_gismo_become_requests() -> None:
    def write(values: Any) -> str:
        return "\n".join(" ".join(map(repr, row)) for row in np.asarray(values).tolist())

    vectors = "".join(
        f'<Basis type="BSplineBasis" index="{n}"><KnotVector degree="{p}">'
        f"{' '.join(map(str, knots))}</KnotVector></Basis>"
        for n, (p, knots) in enumerate(((2, KNOTS_U), (1, KNOTS_V)))
    )
    text = (
        '<?xml version="1.0"?><xml><Geometry type="TensorNurbs2" id="0">'
        f'<Basis type="TensorNurbsBasis2"><Basis type="TensorBSplineBasis2">{vectors}</Basis>'
        f"<weights>{write(WEIGHTS.T.reshape(-1, 1))}</weights></Basis>"
        f'<coefs geoDim="3">{write(NET.swapaxes(0, 1).reshape(-1, 3))}</coefs></Geometry></xml>'
    )
    check(PROGRAMS["from_gismo"](text))


def test_surfaces_of_three_become_requests() -> None:
    (program,) = [block.text for block in BLOCKS if block.language == "js"]
    points = np.concatenate((NET, WEIGHTS[..., None]), axis=2).tolist()
    source = f"""
        import {{ Vector3, Vector4 }} from "three";
        import {{ NURBSSurface }} from "three/addons/curves/NURBSSurface.js";
        {program}
        const points = {points}.map((row) => row.map((p) => new Vector4(...p)));
        const surface = new NURBSSurface(2, 1, {KNOTS_U}, {KNOTS_V}, points);
        const evaluated = {(UV / [1, 2]).tolist()}.map(([u, v]) => {{
            const point = new Vector3();
            surface.getPoint(u, v, point);
            return point.toArray();
        }});
        console.log(JSON.stringify([fromThree(surface), evaluated]));
    """
    process = subprocess.run(
        [find_program("node"), "--input-type=module"],
        input=source,
        cwd=ROOT / "tests" / "web",
        capture_output=True,
        text=True,
        check=True,
    )
    surface, expected = json.loads(process.stdout)
    np.testing.assert_allclose(evaluate(surface)[:-1], expected[:-1], atol=1e-14)
    check(surface)
