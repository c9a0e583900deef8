"""Breps made ready for meshing: which parameter curves are used, what is made, what is refused."""

from typing import Any

import numpy as np
import pytest

from oracles.solids import VALID, read_solid
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.engine.brep.topology import SEAM
from service.errors import InvalidRequest
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.brep import BrepSurface
from service.surface.brep_model import BrepModel

Document = dict[str, Any]

SEAMLESS = ("cone", "revolve", "sphere_hole", "tee", "thread", "torus_cut")
BARE = ("crossholes", "ellip", "plate", "sphere", "spring", "torus", "tray", "viviani")


def lower(document: Document) -> BrepModel:
    surface = validate_document(MeshRequest, {"surface": document}).to_surface()
    assert isinstance(surface, BrepSurface)
    return surface.lower()


def strip_pcurves(document: Document) -> Document:
    """The brep without parameter curves and poles: faces have edges alone."""
    for face in document["faces"]:
        for loop in face["loops"]:
            poles = [bool(document["edges"][e].get("degenerate")) for e in loop["edges"]]
            is_reversed = loop.get("reversed", [False] * len(poles))
            loop["reversed"] = [r for r, pole in zip(is_reversed, poles, strict=True) if not pole]
            loop["edges"] = [e for e, pole in zip(loop["edges"], poles, strict=True) if not pole]
            loop.pop("pcurves", None)
        face["loops"] = [loop for loop in face["loops"] if loop["edges"]]
    return document


def strip_seams(document: Document) -> Document:
    """The brep without parameter curves, and without edges that one face has twice."""
    document = strip_pcurves(document)
    for face in document["faces"]:
        edges = [e for loop in face["loops"] for e in loop["edges"]]
        sides = [
            (e, r)
            for loop in face["loops"]
            for e, r in zip(loop["edges"], loop["reversed"], strict=True)
            if edges.count(e) == 1
        ]
        face["loops"] = []
        while sides:
            chain = [sides.pop(0)]
            ends = [document["edges"][e]["vertices"][:: -1 if r else 1] for e, r in chain]
            while ends[-1][1] != ends[0][0]:
                following = next(
                    side
                    for side in sides
                    if document["edges"][side[0]]["vertices"][-1 if side[1] else 0] == ends[-1][1]
                )
                sides.remove(following)
                chain.append(following)
                e, r = following
                ends.append(document["edges"][e]["vertices"][:: -1 if r else 1])
            face["loops"].append(
                {"edges": [e for e, _ in chain], "reversed": [r for _, r in chain]}
            )
    return document


def count_cracks(prepared: PreparedBrep) -> int:
    """Directed edges of a coarse mesh that do not occur as often as their reverses."""
    limits = MeshLimits(100_000, Effort())
    mesh = triangulate_brep(prepared, Goal(tolerance=0.02 * prepared.diagonal), limits)
    corners = mesh.points[mesh.triangles]
    a, b = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]).T
    count = len(mesh.positions)
    forward, backward = np.sort(a * count + b), np.sort(b * count + a)
    assert len(forward)
    return int((forward != backward).sum())


@pytest.mark.parametrize("name", BARE)
def test_a_solid_of_edges_alone_is_closed(name: str) -> None:
    prepared = prepare(lower(strip_pcurves(read_solid(name))))
    assert prepared.gaps.max() < 1e-6 * prepared.diagonal
    assert count_cracks(prepared) == 0


@pytest.mark.parametrize("name", SEAMLESS)
def test_a_solid_without_seams_is_closed(name: str) -> None:
    prepared = prepare(lower(strip_seams(read_solid(name))))
    assert (prepared.edge_sources == SEAM).any()
    assert prepared.gaps.max() < 1e-6 * prepared.diagonal
    assert count_cracks(prepared) == 0


def test_gaps_of_solids_are_those_of_many_points() -> None:
    """At many parameters, no edge is further from its parameter curve than proved."""
    share = np.linspace(0, 1, 101)
    for name in VALID[::6]:
        prepared = prepare(lower(read_solid(name)))
        rows = (prepared.edge_curves[prepared.coedge_edges] >= 0).nonzero()[0]
        edges = prepared.coedge_edges[rows]
        start, end = prepared.edge_ranges[edges].T
        t = (start[:, np.newaxis] + (end - start)[:, np.newaxis] * share).ravel()
        run = np.repeat(rows, len(share))
        curve = prepared.edge_curves[prepared.coedge_edges[run]]
        places = prepared.pcurves.evaluate(run, t)
        image = prepared.places.evaluate(prepared.coedge_faces[run], places)
        apart = np.linalg.norm(image - prepared.curves.evaluate(curve, t), axis=1)
        worst = apart.reshape(-1, len(share)).max(axis=1)
        # Knots are places here, up to half a unit of 2^30.
        assert (worst <= prepared.gaps[rows] + 1e-8 * prepared.diagonal).all()


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


def test_a_pole_inside_a_face_may_be_a_loop_of_its_own() -> None:
    document = strip_seams(read_solid("cone"))
    alone = prepare(lower(document))
    (pole,) = [k for k, edge in enumerate(document["edges"]) if edge.get("degenerate")]
    face = next(f for f in document["faces"] if f["surface"].get("degree") != [1, 1])
    face["loops"].append({"edges": [pole]})
    prepared = prepare(lower(document))
    assert prepared.loop_counts.tolist() == alone.loop_counts.tolist()
    assert count_cracks(prepared) == 0


def test_a_sphere_whose_loop_is_a_pole_is_whole() -> None:
    document = read_solid("sphere")
    (pole, *_) = [k for k, edge in enumerate(document["edges"]) if edge.get("degenerate")]
    document["faces"][0]["loops"] = [{"edges": [pole]}]
    document["shells"][0]["closed"] = False
    prepared = prepare(lower(document))
    assert prepared.loop_counts.tolist() == [4]
    assert count_cracks(prepared) == 0


@pytest.mark.parametrize("name", ["cone", "impeller", "sphere", "tee", "torus_cut"])
def test_wrong_parameter_curves_are_made_anew(name: str) -> None:
    """Parameter curves that are noisy, reversed or nearly constant."""
    rng = np.random.default_rng(len(name))
    document = read_solid(name)
    for face in document["faces"]:
        surface = face["surface"]
        knots = [np.array(k) for k in surface.get("knots", [[0, 1], [0, 1]])]
        size = np.array([k[-1] - k[0] for k in knots])
        for loop in face["loops"]:
            for edge, pcurve in zip(loop["edges"], loop["pcurves"], strict=True):
                if pcurve is None or document["edges"][edge].get("degenerate"):
                    continue
                points = np.array(pcurve["control_points"])
                match int(rng.integers(6)):
                    case 0:
                        points = points[::-1]
                    case 1:
                        points = points[0] + 1e-6 * (points - points[0])
                    case 2 | 3:
                        scale = 10.0 ** -rng.integers(1, 4)
                        points = points + scale * size * rng.normal(size=points.shape)
                pcurve["control_points"] = points.tolist()
    prepared = prepare(lower(document))
    assert prepared.pcurves_replaced > 0
    assert prepared.gaps.max() < 2e-6 * prepared.diagonal
    assert count_cracks(prepared) == 0


def test_loops_a_period_away_belong_to_the_same_region() -> None:
    """All parameter curves of a loop moved by a period: a hole of a cylinder."""
    document = read_solid("tee")
    moved = 0
    for face in document["faces"]:
        knots = face["surface"].get("knots")
        if not knots or len(face["loops"]) < 2:
            continue
        for pcurve in face["loops"][-1]["pcurves"]:
            period = knots[0][-1] - knots[0][0]
            pcurve["control_points"] = [[u + period, v] for u, v in pcurve["control_points"]]
            moved += 1
    assert moved
    assert count_cracks(prepare(lower(document))) == 0
