"""Modules of the editor that read files: how files are known, and how several become one group."""

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service.api.page_facts import describe_files
from service.decoders import refused, registry
from service.settings.values import Settings
from tests.decoders.test_refused import BODIES, OTHERS

STARTS = {
    **BODIES,
    **{suffix: content for suffix, (content, _) in OTHERS.items() if content},
    "step": b"\xef\xbb\xbf  \n/* by * hand */ /**/\nISO-10303-21;",
    "igs": b"a part".ljust(72) + b"S      1\n",
    "3dm": b"3D Geometry File Format        8",
    "npy": b"\x93NUMPY\1\0",
    "geomdl": b' {"shape": {',
    "json": b'{"type": "brep"}',
    "obj": b"v 0 0 0\ncstype bezier\n",
    "bez": b"BEZ214\n1 0 0 1",
}


def identify(page: Page, name: str, start: bytes) -> Any:
    """The identity of a file in the editor."""
    return page.evaluate(
        """async ([name, start, facts]) => (
          (await import('/page/identify.js')).identify(name, start, facts))""",
        [name, start[:4096].decode("latin-1"), describe_files(Settings())],
    )


def test_the_page_and_the_service_know_files_by_the_same_beginnings(modules: Page) -> None:
    for suffix, content in STARTS.items():
        identity = identify(modules, "", content)
        if (known := refused.find_by_content(content)) is not None:
            assert identity["issue"]["detail"] == known.issue().message, suffix
        elif (decoder := registry.find_by_content(content)) is not None:
            assert identity == {"mediaType": decoder.media_type}, suffix
        else:
            assert identity == {"json": True}, suffix


def test_a_suffix_decides_where_the_content_does_not(modules: Page) -> None:
    assert identify(modules, "A.OBJ", b"v 0 0 0") == {"mediaType": "model/obj"}
    assert identify(modules, "pot.txt", b"2\n1,2,3,4") == {"mediaType": "text/x-teapot"}
    assert identify(modules, "pot.txt", b"[[[0, 0, 0]]]") == {"json": True}
    assert identify(modules, "net.dat", b"\n{}") == {"json": True}
    assert identify(modules, "part.brep", b"ISO-10303-21;") == {"mediaType": "model/step"}
    # A 3MF file is an archive; its suffix says more.
    archive = identify(modules, "part.3mf", b"PK\3\4" + bytes(26) + b"[Content_Types].xml")
    assert "triangles" in archive["issue"]["detail"]


def list_points(page: Page, surfaces: list[dict[str, Any]], *, joined: bool) -> np.ndarray:
    """The control points of surfaces, in metres of the scene, where y points up; (N, 3)."""
    points = page.evaluate(
        """async ([surfaces, isJoined]) => {
          const { joinSurfaces } = await import('/page/join.js');
          const { netOf, pointAt } = await import('/page/net.js');
          const named = surfaces.map((surface, i) => ({ name: `file ${i}`, surface }));
          return (isJoined ? [joinSurfaces(named)] : surfaces).flatMap((surface) => {
            const net = netOf(surface);
            return net.handles.map((handle) => {
              const m = net.frames[handle.frame];
              const [x, y, z] = pointAt(surface, handle);
              const unit = surface.metres_per_unit ?? 1;
              const rows = [m.slice(0, 4), m.slice(4, 8), m.slice(8, 12)];
              return rows.map(([a, b, c, d]) => unit * (a * x + b * y + c * z + d));
            });
          });
        }""",
        [surfaces, joined],
    )
    return np.array(points)


@pytest.mark.parametrize("ups", ["yyy", "zzz", "yzz", "zyy", "zyz"])
def test_a_joined_group_has_its_surfaces_where_they_were(modules: Page, ups: str) -> None:
    """Groups with placements and a net, with different units and axes up."""
    net: dict[str, Any] = {"control_net": [[[0, 0, 0], [0, 1, 2]], [[1, 0, 3], [1, 1, 4]]]}
    turned = [[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]
    members = [{"surface": net | {"up": "z"}, "matrix": turned}, {"surface": net, "name": "b"}]
    group: dict[str, Any] = {"type": "group", "members": members}
    surfaces = [
        group | {"up": ups[0], "metres_per_unit": 0.001},
        net | {"up": ups[1]},
        group | {"up": ups[2], "metres_per_unit": 0.0254},
    ]
    expected = list_points(modules, surfaces, joined=False)
    assert list_points(modules, surfaces, joined=True) == pytest.approx(expected, abs=1e-12)


def test_numbers_of_definitions_and_parents_are_those_of_the_whole_group(modules: Page) -> None:
    group = {
        "type": "group",
        "definitions": [{"control_net": []}],
        "members": [{"name": "frame"}, {"name": "bolt", "definition": 0, "parent": 0}],
    }
    joined = modules.evaluate(
        """async (group) => (await import('/page/join.js')).joinSurfaces(
          [{ name: 'a', surface: group }, { name: 'b', surface: group }])""",
        group,
    )
    assert len(joined["definitions"]) == 2
    assert [member.get("definition") for member in joined["members"]] == [None, 0, None, 1]
    assert [member.get("parent") for member in joined["members"]] == [None, 0, None, 2]
    assert [member["name"] for member in joined["members"]] == [
        "a frame",
        "bolt",
        "b frame",
        "bolt",
    ]


@pytest.mark.parametrize(
    ("text", "kind", "note"),
    [
        ("[[[0,0,0],[1,0,0]],[[0,1,0],[1,1,0]]]", "bezier", "degree (1, 1)"),
        ('{"surface": [[[0,0],[1,0]],[[0,1],[1,1]]]}', "bezier", "degree (1, 1)"),
        ('[{"control_net": []}, {"surface": {"name": "x"}}]', "group", "2 surfaces"),
        (
            "[[[[0,0,0],[1,0,0]],[[0,1,0],[1,1,0]]],"
            " [[[0,0,0],[1,0,0],[2,0,0]],[[0,1,0],[1,1,0],[2,1,0]]]]",
            "group",
            "2 control nets",
        ),
    ],
)
def test_bare_arrays_become_surfaces(modules: Page, text: str, kind: str, note: str) -> None:
    opened = modules.evaluate(
        "async (text) => (await import('/page/requests.js')).parseRequest(text)", text
    )
    assert opened["surface"]["type"] == kind
    assert note in opened["note"]


@pytest.mark.parametrize(
    "text", ["[]", "[1, 2]", "[[1, 2]]", "[[[[[1]]]]]", "null", '"a"', "[[], {}]"]
)
def test_other_json_is_no_surface(modules: Page, text: str) -> None:
    codes = modules.evaluate(
        """async (text) => {
          const { parseRequest } = await import('/page/requests.js');
          try {
            return parseRequest(text);
          } catch (error) {
            return error.errors.map(({ code }) => code);
          }
        }""",
        text,
    )
    assert codes == ["wrong_type"]
