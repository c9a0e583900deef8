"""What is estimated is what comes out, or no less; and what is refused is refused for that."""

import json
from typing import Any

import pytest

from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MeshOptions
from service.errors import Issue, SurfaceError
from service.pipeline.estimate import Estimate, estimate, estimate_object
from service.pipeline.limits import Limits
from service.pipeline.mesh import PLAIN, render
from service.surface.examples import EXAMPLES, find
from service.surface.group import GroupSurface, Member
from tests.encoders.glb_reader import read_glb

COUNTS = ("vertices", "triangles", "quads")

INEXACT = {"trefoil-tube", "ribbon", "hair"}
"""Examples that are swept along curves, or hold what is."""


def issues_of(found: Estimate, fmt: Format) -> set[Issue]:
    return {refusal.issue for refusal in found.refusals if fmt.name in refusal.formats}


def check(
    surface: Any, options: MeshOptions, encode: EncodeOptions = PLAIN, limits: Limits | None = None
) -> Estimate:
    """Compares the estimate with the files of all formats."""
    limits = limits or Limits()
    found = estimate(surface, options, encode, limits)
    sizes = {name: (size, exact) for name, size, exact in found.sizes}
    answered = 0
    for fmt in FORMATS:
        content, issues = rendered(surface, options, fmt, encode, limits)
        assert issues_of(found, fmt) == issues
        if issues:
            continue
        answered += 1
        size, exact = sizes[fmt.name]
        assert len(content) == size if exact else len(content) <= size
        for report in reports(fmt, content):
            for name in COUNTS:
                wanted = getattr(found.counts, name)
                assert report[name] == wanted if found.exact else report[name] <= wanted
    assert found.accepted == (answered > 0)
    return found


def rendered(*request: Any) -> tuple[bytes, set[Issue]]:
    """The file, or what is wrong with the request."""
    try:
        return render(*request), set()
    except SurfaceError as error:
        return b"", set(error.issues)


def reports(fmt: Format, content: bytes) -> list[dict[str, Any]]:
    """The report in a file, where the format has a place for it."""
    if fmt.name == "json":
        return [json.loads(content)["report"]]
    if fmt.name == "glb":
        return [read_glb(content).document["asset"]["extras"]["report"]]
    return []


@pytest.mark.parametrize("example", EXAMPLES)
@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_examples(example: str, faces: Any) -> None:
    found = check(find(example).surface(), MeshOptions((3, 4), faces=faces))
    assert found.exact == (example not in INEXACT)
    exact = [name for name, _, exact in found.sizes if exact]
    assert exact == (["stl"] if found.exact and faces == "triangles" else [])


@pytest.mark.parametrize(
    "options",
    [
        {"weld": False},
        {"normals": False, "uvs": True},
        {"overlays": ("control_net", "boundary")},
        {"isocurves": (2, 2)},
        {"isocurves": (2, 2), "surface": False},
        {"overlays": ("boundary",), "surface": False},
    ],
)
def test_options(options: dict[str, Any]) -> None:
    for example in ("utah-teapot", "octahedral-sphere", "tea-service"):
        assert check(find(example).surface(), MeshOptions((2, 2), **options)).exact


@pytest.mark.parametrize("wires", ["tubes", "ribbons"])
def test_wires_with_faces_are_bounded(wires: Any) -> None:
    found = check(find("cone").surface(), MeshOptions((3, 3), isocurves=(1, 2), wires=wires))
    assert not found.exact


@pytest.mark.parametrize("form", ["cquad", "mesh", "off", "bez"])
def test_forms_of_oogl(form: Any) -> None:
    found = check(find("saddle").surface(), MeshOptions((4, 4)), EncodeOptions(form))
    assert found.accepted


def test_copies_in_a_group_are_counted_each_and_stored_once() -> None:
    teapot = find("utah-teapot").surface()
    group = GroupSurface(tuple(Member(teapot, f"{k}", None, None) for k in range(5)))
    one, five = (estimate(s, MeshOptions((8, 8))) for s in (teapot, group))
    assert five.counts.triangles == 5 * one.counts.triangles
    sizes = [{name: size for name, size, _ in found.sizes} for found in (one, five)]
    assert sizes[1]["glb"] < 2 * sizes[0]["glb"]
    assert sizes[1]["ply"] > 4.5 * sizes[0]["ply"]
    check(group, MeshOptions((2, 2)))


def test_limits_are_those_of_the_mesh() -> None:
    surface = find("utah-teapot").surface()
    for limits in (
        Limits(max_vertices=9248),
        Limits(max_vertices=9247),
        Limits(max_bytes=900_000),
        Limits(max_bytes=1000),
    ):
        check(surface, MeshOptions(), limits=limits)


def test_what_is_refused_for_its_size_is_still_counted() -> None:
    found = estimate(find("saddle").surface(), MeshOptions((60_000, 60_000)))
    assert not found.accepted
    assert not found.exact
    assert found.counts.vertices == 60_001**2
    (refusal,) = found.refusals
    assert refusal.formats == tuple(BY_NAME)
    assert (refusal.issue.code, refusal.issue.pointer) == ("too_many_vertices", "/resolution")
    assert {name: size for name, size, _ in found.sizes}["stl"] == 84 + 50 * 2 * 60_000**2


def test_as_json_it_names_formats_with_their_bytes_and_what_is_wrong() -> None:
    surface, options = find("saddle").surface(), MeshOptions((2, 2), faces="quads")
    formats = [BY_NAME["stl"], BY_NAME["off"]]
    found: dict[str, Any] = estimate_object(estimate(surface, options, formats=formats))
    assert found["bytes"] == {"off": found["bytes"]["off"]}
    assert (found["vertices"], found["triangles"], found["quads"]) == (9, 0, 4)
    assert (found["exact"], found["exact_bytes"], found["accepted"]) == (True, [], True)
    (refused,) = found["refused"]
    assert refused["formats"] == ["stl"]
    assert (refused["code"], refused["pointer"]) == ("unsupported_by_format", "/faces")
    assert set(refused) == {"formats", "code", "pointer", "detail", "got", "needed"}
