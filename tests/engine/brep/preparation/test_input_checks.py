"""Which parameter curves are used, and which faces are refused or left out."""

from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.engine.brep.preparation.prepare import prepare
from service.errors import InvalidRequest
from tests.engine.brep.solid_documents import Document, lower


def build_sheet(**face: Any) -> Document:
    """A face on the square [0, 10]², with a square hole, at the height 0."""
    corners = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]]
    inner = [[3, 3, 0], [3, 6, 0], [6, 6, 0], [6, 3, 0]]
    numbers = [0, 1, 2, 3]
    edges = [{"vertices": [a, (a + 1) % 4]} for a in numbers]
    edges += [{"vertices": [4 + a, 4 + (a + 1) % 4]} for a in numbers]
    return {
        "type": "brep",
        "vertices": corners + inner,
        "edges": edges,
        "faces": [
            {
                "surface": {"control_net": [[[0, 0, 0], [0, 10, 0]], [[10, 0, 0], [10, 10, 0]]]},
                "loops": [{"edges": numbers}, {"edges": [4, 5, 6, 7]}],
            }
            | face
        ],
        "shells": [{"faces": [0], "closed": False}],
    }


def refuse(document: Document) -> tuple[str, str]:
    """The code and the pointer with which a brep is refused; and it is meshed without the face."""
    with pytest.raises(InvalidRequest) as caught:
        prepare(lower(document))
    issue = caught.value.issues[0]
    prepared = prepare(lower(document | {"invalid_faces": "skip"}))
    assert [(each.face, each.issue) for each in prepared.skipped_faces] == [(0, issue)]
    assert not len(prepared.loop_faces)
    return issue.code, issue.pointer


def test_a_valid_sheet_is_not_refused() -> None:
    prepared = prepare(lower(build_sheet()))
    assert prepared.loop_counts.tolist() == [4, 4]
    assert prepared.skipped_faces == ()
    assert prepared.pcurves_replaced == 0
    np.testing.assert_allclose(prepared.box, [[0, 0, 0], [10, 10, 0]], atol=1e-9)


def test_loops_in_the_wrong_direction_are_refused() -> None:
    outer = build_sheet(loops=[{"edges": [3, 2, 1, 0], "reversed": [True] * 4}])
    assert refuse(outer) == ("loop_reversed", "/faces/0/loops/0")
    inner = {"edges": [7, 6, 5, 4], "reversed": [True] * 4}
    hole = build_sheet(loops=[{"edges": [0, 1, 2, 3]}, inner])
    assert refuse(hole) == ("loop_reversed", "/faces/0/loops/1")


def test_loops_that_cross_are_refused() -> None:
    document = build_sheet()
    document["vertices"][4:] = [[8, 8, 0], [8, 12, 0], [12, 12, 0], [12, 8, 0]]
    code, pointer = refuse(document)
    assert (code, pointer) == ("loops_cross", "/faces/0/loops/0")


def test_an_edge_far_from_its_surface_is_refused() -> None:
    document = build_sheet(loops=[{"edges": [0, 1, 2, 3]}])
    bulge = {"degree": 2, "knots": [0, 0, 0, 1, 1, 1]}
    points = [[0, 0, 0], [5, 0, 8], [10, 0, 0]]
    document["edges"][0]["curve"] = {"type": "bspline", "control_points": points, **bulge}
    assert refuse(document) == ("edge_not_on_surface", "/faces/0/loops/0/edges/0")
    # A gap is no reason to refuse.
    points[1] = [5, 0, 1]
    prepared = prepare(lower(document))
    assert prepared.gaps.max() == pytest.approx(0.5, rel=0.5)
    assert prepared.gaps.max() >= 0.5


def build_bent() -> Document:
    """A face on a bent square, trimmed by parameter curves alone."""
    document = build_sheet()
    net = [[[10 * i, 10 * j, (i - 1) ** 2] for j in (0, 1)] for i in (0, 1, 2)]
    knots = [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1]]
    corners = [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]]
    sides = [
        {"type": "bspline", "degree": 1, "knots": [0, 0, 1, 1], "control_points": [a, b]}
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    document["faces"][0] = {
        "surface": {"type": "bspline", "degree": [2, 1], "knots": knots, "control_net": net},
        "loops": [{"pcurves": sides}],
    }
    return document | {"vertices": [], "edges": []}


def test_loops_of_parameter_curves_alone_have_edges() -> None:
    prepared = prepare(lower(build_bent()))
    assert prepared.loop_counts.tolist() == [4]
    assert prepared.gaps.max() < 1e-9
    # The side along v is a line, that along u a parabola.
    assert sorted(prepared.curves.degree.tolist()) == [1, 1, 2, 2]
    ends = prepared.vertices[prepared.edge_vertices]
    for k in (0, 1):
        t = prepared.edge_ranges[:, k]
        reached = prepared.curves.evaluate(np.arange(4), t)
        np.testing.assert_allclose(reached, ends[:, k], atol=1e-12)


def test_a_parameter_curve_outside_of_the_domain_is_refused() -> None:
    document = build_bent()
    for side in document["faces"][0]["loops"][0]["pcurves"]:
        side["control_points"] = [[u + 0.15, v] for u, v in side["control_points"]]
    code, pointer = refuse(document)
    assert (code, pointer) == ("pcurve_outside", "/faces/0/loops/0/pcurves/0")


def test_a_parameter_curve_outside_of_the_domain_is_made_anew_if_it_has_an_edge() -> None:
    """It is nearer to its edge than the uncertainty, and 0.018 beyond the end of the cylinder."""
    document = read_solid("cylinder") | {"uncertainty": 0.05}
    upper = document["faces"][0]["loops"][0]["pcurves"][0]
    assert upper["control_points"][0] == [0.0, 12.0]
    upper["control_points"] = [[u, 12.03] for u, _ in upper["control_points"]]
    prepared = prepare(lower(document))
    assert int(prepared.is_replaced.sum()) == 1
    assert prepared.gaps.max() < 1e-6


@pytest.mark.parametrize(("shift", "replaced"), [(0.0, 0), (1e-7, 0), (1e-4, 1)])
def test_a_given_parameter_curve_is_used_if_it_is_near_its_edge(
    shift: float, replaced: int
) -> None:
    document = build_sheet(loops=[{"edges": [0, 1, 2, 3], "pcurves": [None] * 4}])
    points = [[0, shift], [1, shift]]
    line = {"type": "bspline", "degree": 1, "knots": [0, 0, 2, 2], "control_points": points}
    document["faces"][0]["loops"][0]["pcurves"][0] = line
    document["uncertainty"] = 2e-6
    prepared = prepare(lower(document))
    assert prepared.pcurves_replaced == replaced
    gap = 0.0 if replaced else 10 * shift
    assert gap <= prepared.gaps[0] <= 2 * gap + 1e-9
