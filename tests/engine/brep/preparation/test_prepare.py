"""Breps made ready for meshing: what is made of edges alone, and of wrong parameter curves."""

import numpy as np
import pytest

from oracles.solids import INVALID, VALID, read_solid
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.preparation.topology import SEAM
from tests.engine.brep.solid_documents import count_cracks, lower, strip_pcurves, strip_seams

SEAMLESS = ("cone", "revolve", "sphere_hole", "tee", "thread", "torus_cut")
BARE = ("crossholes", "ellip", "plate", "sphere", "spring", "torus", "tray", "viviani")


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


def test_a_face_whose_loop_is_reversed_where_edges_are_off_the_surface_is_left_out() -> None:
    """The edges of one face are on another plane, 1.5 away, and run around it the wrong way."""
    prepared = prepare(lower(read_solid(INVALID)))
    (skipped,) = prepared.skipped_faces
    assert (skipped.face, skipped.issue.code) == (26, "loop_reversed")
    assert 1.5 <= prepared.left_out_gap <= 2.2
    assert prepared.gaps.max() < 1e-6


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
