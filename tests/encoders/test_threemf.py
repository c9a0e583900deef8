"""3MF: closed meshes of millimetres with z upwards; copies, colours, mirrors."""

from collections import Counter
from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from oracles.topology import count_topology
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import UnsupportedByFormat
from service.pipeline.mesh import render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.examples.catalogue import find
from service.surface.sizes import SurfaceKind
from tests.encoders.threemf_file import CORE, Body, File, read

FMT = BY_NAME["3mf"]
COARSE = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-2))


def write(surface: SurfaceKind, options: MeshOptions | None = None) -> File:
    content = render(surface, options or MeshOptions(resolution=(4, 4)), FMT)
    assert render(surface, options or MeshOptions(resolution=(4, 4)), FMT) == content
    return read(content)


def read_surface(document: dict[str, Any]) -> SurfaceKind:
    return validate_document(MeshRequest, {"surface": document}).to_surface()


def check_closed(body: Body) -> None:
    topology = count_topology(body.triangles)
    assert topology.watertight
    assert body.volume > 0
    assert body.kind == "model"


@pytest.mark.parametrize("name", ["sphere", "nurbs-goblet", "bspline-ring", "octahedral-sphere"])
def test_closed_surfaces_are_closed_meshes_without_double_corners(name: str) -> None:
    """Poles and seams have one vertex for each position."""
    (body,) = write(find(name).surface()).bodies
    check_closed(body)
    assert len({tuple(point) for point in body.points.tolist()}) == len(body.points)


def test_open_surfaces_have_the_type_surface() -> None:
    (body,) = write(find("saddle").surface()).bodies
    assert body.kind == "surface"
    assert body.name == "saddle"


@pytest.mark.parametrize(("up", "axis"), [("y", 1), ("z", 2)])
@pytest.mark.parametrize("metres", [None, 0.001, 0.0254, 1.0])
def test_lengths_are_millimetres_and_z_is_up(up: str, axis: int, metres: float | None) -> None:
    box = read_solid("box") | {"up": up} | ({} if metres is None else {"metres_per_unit": metres})
    surface = read_surface(box)
    sides = np.ptp(box["vertices"], axis=0)
    (body,) = write(surface, COARSE).bodies
    check_closed(body)
    scale = 1 if metres is None else metres * 1000
    assert np.ptp(body.points[:, 2]) == pytest.approx(scale * sides[axis], rel=1e-6)
    assert body.volume == pytest.approx(scale**3 * np.prod(sides), rel=1e-6)


def place(x: float, *diagonal: float) -> list[list[float]]:
    matrix = np.diag([*(diagonal or (1.0, 1.0, 1.0)), 1.0])
    matrix[0, 3] = x
    return matrix.tolist()


def test_copies_are_components_of_one_object_each_form() -> None:
    """A copy in another colour, and a mirrored one, have an object of their own."""
    bolt = read_solid("bolt")
    red, blue = [1, 0, 0], [0, 0, 1, 0.5]
    group = {
        "type": "group",
        "name": "four & more",
        "members": [
            {"name": "a", "surface": bolt, "color": red},
            {"name": "b", "surface": bolt, "color": red, "matrix": place(40)},
            {"name": "c", "surface": bolt, "color": red, "matrix": place(80, -1, 1, 1)},
            {"name": "d", "surface": bolt, "color": red, "matrix": place(120, 1, -2, 1)},
            {"name": "e", "surface": bolt, "color": blue, "matrix": place(160)},
        ],
    }
    file = write(read_surface(group), COARSE)
    assert len(file.bodies) == 5
    for body in file.bodies:
        check_closed(body)
    assert Counter(body.object for body in file.bodies).most_common()[0][1] == 2
    assert len({body.object for body in file.bodies}) == 3
    first = file.bodies[0].volume
    assert [body.volume / first for body in file.bodies] == pytest.approx([1, 1, 1, 2, 1])
    assert [set(body.colors) for body in file.bodies] == [
        *([{("#FF0000FF",) * 3}] * 4), {("#0000FF80",) * 3},
    ]  # fmt: skip
    assert file.objects[-1].attrib["name"] == "four & more"
    # The mirrored copy has the same points as the mesh mirrored by hand.
    plain, mirrored = (body.points for body in (file.bodies[0], file.bodies[2]))
    expected = np.sort(plain * [-1, 1, 1] + [80, 0, 0], axis=0)
    assert np.allclose(np.sort(mirrored, axis=0), expected, atol=1e-4)


def test_faces_of_a_brep_have_their_colours() -> None:
    box = read_solid("box")
    box["faces"][0]["color"] = [1, 0.5, 0]
    (body,) = write(read_surface(box), COARSE).bodies
    check_closed(body)
    assert Counter(body.colors) == {("#FFFFFFFF",) * 3: 10, ("#FF8000FF",) * 3: 2}


def test_vertices_have_colours() -> None:
    (body,) = write(find("bourke-1111-colors").surface()).bodies
    assert len({color for corners in body.colors for color in corners}) > 3


def test_names_are_escaped() -> None:
    name = "a \"quoted\" <name> & 'more' Größe"
    (body,) = write(read_surface(read_solid("box") | {"name": name}), COARSE).bodies
    assert body.name == name


def test_the_bound_is_in_the_description() -> None:
    file = write(find("sphere").surface(), COARSE)
    texts = {each.attrib["name"]: each.text for each in file.root.iter(f"{CORE}metadata")}
    assert texts["Title"] == "sphere"
    assert (texts["Description"] or "").startswith("deviation_bound ")


def test_large_coordinates_keep_their_digits() -> None:
    """Positions are float32 about an origin, which is in the transform."""
    net = [[[1e6 + x / 8, y / 8, 0.0] for y in range(2)] for x in range(2)]
    (body,) = write(read_surface({"type": "bezier", "control_net": net, "up": "z"})).bodies
    assert np.ptp(body.points[:, 0]) == pytest.approx(0.125, abs=1e-9)


def test_quads_are_refused() -> None:
    with pytest.raises(UnsupportedByFormat):
        render(find("saddle").surface(), MeshOptions(resolution=(2, 2), faces="quads"), FMT)
