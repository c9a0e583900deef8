"""The nets of parts: points, the places of regions that they have, and placed copies."""

from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.bases.arrays import FloatArray, Ints
from service.engine.accuracy import Accuracy
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.nets.partials import net_partials
from service.engine.options import MeshOptions
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.engine.trims.inside import INSIDE
from service.engine.trims.places import SIZE
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.lowered import GroupModel
from tests.engine.brep.solid_documents import lower
from tools.building import build

Document = dict[str, Any]

LIMITS = WorkLimits(pairs=1 << 20, of_item=1000)

SADDLE = {
    "type": "bezier",
    "up": "z",
    "control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]],
}

MIRROR = np.array([[0, -2, 0, 30], [2, 0, 0, 1], [0, 0, -2, -7], [0, 0, 0, 1.0]])
"""Turns by a right angle, mirrors and doubles."""


def lower_group(*members: Document) -> GroupModel:
    document = {"type": "group", "up": "z", "members": list(members)}
    model = validate_document(MeshRequest, {"surface": document}).to_surface().lower()
    assert isinstance(model, GroupModel)
    return model


def evaluate(part: Part, net: Ints, parameters: FloatArray) -> FloatArray:
    """Points (m, 3) of nets in model coordinates."""
    points = net_partials(part.nets, net, parameters, 1)[0]
    result: FloatArray = part.nets.origin + points.T * part.nets.scale
    return result


@pytest.mark.parametrize("name", ["crossholes", "impeller", "pipe", "tray"])
def test_nets_are_on_surfaces_and_edges(name: str) -> None:
    part = build_part(lower(read_solid(name)))
    (prepared,) = part.members.definitions
    rng = np.random.default_rng(2)
    net = rng.integers(0, part.surface_nets, 500)
    parameters = rng.random((2, 500))
    points = evaluate(part, net, parameters)
    face, of_face = part.rows.face[net], part.trims.to_face(net, parameters)
    np.testing.assert_array_equal(part.nets.patch[net], face)
    errors = part.nets.errors
    assert errors is not None
    expected = prepared.surfaces.evaluate(face, of_face)
    reach = (errors[net] + 2.0**-46) * part.nets.scale
    assert (np.linalg.norm(points - expected, axis=1) <= reach).all()
    # The patches of the spans have the same points.
    local = part.nets.parameters(net, parameters.T)
    expected = prepared.surfaces.nets.evaluate_points(part.rows.span[net], *local.T)
    assert (np.linalg.norm(points - expected, axis=1) <= reach).all()
    edges = part.edges
    row = rng.choice(np.flatnonzero(edges.edge >= 0), 500)
    share = rng.random(500)
    points = evaluate(part, part.surface_nets + row, np.stack([share, np.zeros(500)]))
    t = edges.low[row] + share * (edges.high[row] - edges.low[row])
    expected = prepared.curves.evaluate(prepared.edge_curves[edges.edge[row]], t)
    reach = (errors[part.surface_nets + row] + 2.0**-46) * part.nets.scale
    assert (np.linalg.norm(points - expected, axis=1) <= reach).all()
    np.testing.assert_array_equal(prepared.coedge_edges[edges.coedge[row]], edges.edge[row])
    np.testing.assert_array_equal(prepared.coedge_faces[edges.coedge[row]], edges.face[row])


@pytest.mark.parametrize("name", ["sliver", "viviani", "wavy", "thread"])
def test_cells_have_each_place_of_a_region_once(name: str) -> None:
    part = build_part(lower(read_solid(name)))
    (prepared,) = part.members.definitions
    rng = np.random.default_rng(3)
    cells = CellTree(part.nets, LIMITS, trims=part.trims)
    for _ in range(4):
        is_cut = cells.is_cut[cells.first]
        children, _ = cells.children(cells.first[is_cut])
        cells.first = np.concatenate([cells.first[~is_cut], children])
    first = cells.first[cells.net[cells.first] < part.surface_nets]
    low, high = (
        part.trims.to_face(cells.net[first], cells.rectangle[k::2, first]) for k in range(2)
    )
    face = rng.integers(0, len(prepared.surfaces), 2000)
    places = rng.random((2000, 2)) * SIZE
    uv = prepared.places.to_parameters(face, places)
    windings = prepared.regions.find_windings(face, uv)
    is_inside = windings.numbers == 1
    is_inside[windings.rows] = False
    uv, face = uv[is_inside], face[is_inside]
    assert len(face) > 200
    own = part.rows.face[cells.net[first]]
    covers = (low <= uv[:, np.newaxis]) & (uv[:, np.newaxis] <= high)
    counts = (covers.all(axis=2) & (own == face[:, np.newaxis])).sum(axis=1)
    np.testing.assert_array_equal(counts, 1)
    # Cells that are not cut are inside, at their middles and nearly at their corners.
    whole = first[~cells.is_cut[first]]
    for share in (0.5, 1e-6, 1 - 1e-6):
        parameters = cells.rectangle[::2, whole] + share * (
            cells.rectangle[1::2, whole] - cells.rectangle[::2, whole]
        )
        assert (part.trims.find_inside(cells.net[whole], parameters) == INSIDE).all()


def test_a_surface_far_larger_than_its_face_has_nets_of_the_face() -> None:
    document = read_solid("cylinder")
    small = build_part(lower(document))
    for face in document["faces"]:
        face["surface"] = _stretch(face["surface"])
        for loop in face["loops"]:
            loop.pop("pcurves", None)
    large = build_part(lower(document))
    assert large.surface_nets == small.surface_nets
    for one, other in zip(small.nets.groups, large.nets.groups, strict=True):
        sizes = [
            np.ptp(each.values.reshape(-1, len(each.patches)), axis=0) for each in (one, other)
        ]
        np.testing.assert_allclose(sizes[0], sizes[1], rtol=0.1)
    assert large.nets.errors is not None
    assert large.nets.errors.max() < 1e-10


def _stretch(surface: Document) -> Document:
    """A surface a thousand times as long along v, if it is straight there."""
    if surface["degree"][1] != 1 or len(surface["control_net"][0]) != 2:
        return surface
    net = np.array(surface["control_net"])
    middle, half = (net[:, 1] + net[:, 0]) / 2, (net[:, 1] - net[:, 0]) / 2
    longer = np.stack([middle - 1000 * half, middle + 1000 * half], axis=1)
    return surface | {"control_net": longer.tolist()}


def test_members_of_groups_are_counted_one_after_the_other() -> None:
    """A brep, a patch, and the brep again, mirrored, by one definition of its regions."""
    document = read_solid("frustum")
    model = lower_group(
        {"surface": document},
        {"surface": SADDLE, "matrix": np.diag([3.0, 3, 3, 1]).tolist()},
        {"surface": document, "matrix": MIRROR.tolist()},
    )
    part, alone = build_part(model), build_part(lower(document))
    members = part.members
    assert (len(members.definitions), len(members.copies), members.patch_count) == (1, 2, 7)
    assert np.unique(part.nets.patch[: part.surface_nets]).tolist() == [*range(7)]
    np.testing.assert_array_equal(part.is_reversed[4:], ~part.is_reversed[:3])
    assert part.trims.regions is part.members.definitions[0].regions
    rng = np.random.default_rng(4)
    for first, matrix in ((0, np.eye(4)), (4, MIRROR)):
        for k in range(3):
            mine = np.flatnonzero(part.nets.patch[: part.surface_nets] == first + k)
            own = np.flatnonzero(alone.nets.patch[: alone.surface_nets] == k)
            parameters = rng.random((2, len(own)))
            points = evaluate(alone, own, parameters) @ matrix[:3, :3].T + matrix[:3, 3]
            np.testing.assert_allclose(evaluate(part, mine, parameters), points, atol=1e-12)
            np.testing.assert_array_equal(part.trims.face[mine], alone.trims.face[own])
    saddle = np.flatnonzero(part.nets.patch[: part.surface_nets] == 3)
    assert part.trims.face[saddle].tolist() == [-1]
    np.testing.assert_allclose(evaluate(part, saddle, np.array([[1.0], [0.0]])), [[3, 0, 3]])
    # Gaps are stretched with their copies.
    count = len(alone.edges.edge)
    edges = part.edges
    assert len(edges.edge) == 2 * count
    of_copy = part.rows.copy[part.surface_nets :]
    for number, stretch in ((0, 1.0), (1, 2.0)):
        gaps = np.sort(edges.gaps[of_copy == number]) * part.nets.scale
        np.testing.assert_allclose(gaps, stretch * np.sort(alone.edges.gaps) * alone.nets.scale)


def test_two_breps_have_regions_one_after_the_other() -> None:
    model = lower_group({"surface": read_solid("cone")}, {"surface": read_solid("plate")})
    part = build_part(model)
    regions = [each.regions for each in part.members.definitions]
    counts = [len(each.margins) for each in regions]
    assert (counts, part.members.patch_count) == ([2, 30], 32)
    rng = np.random.default_rng(5)
    for number, first in enumerate((0, counts[0])):
        face = rng.integers(0, counts[number], 500)
        uv = regions[number].places.to_parameters(face, rng.random((500, 2)) * SIZE)
        expected = regions[number].find_inside(face, uv).inside
        np.testing.assert_array_equal(
            part.trims.regions.find_inside(face + first, uv).inside, expected
        )


def test_faces_that_are_skipped_take_no_part() -> None:
    part = build_part(lower(read_solid("shelled")))
    (prepared,) = part.members.definitions
    skipped = [each.face for each in prepared.skipped_faces]
    assert skipped
    assert not np.isin(part.nets.patch, skipped).any()
    assert part.members.patch_count == len(prepared.surfaces)


@pytest.mark.parametrize("name", ["ellip", "crossholes", "cylinder"])
def test_close_gaps_are_closer_and_above_what_is_seen(name: str) -> None:
    document = read_solid(name)
    if name == "cylinder":
        spread_seam(document, 1e-6)
    (prepared,) = build_part(lower(document)).members.definitions
    if name != "cylinder":
        assert (prepared.close_gaps <= prepared.gaps + 1e-11 * prepared.diagonal).all()
        assert prepared.close_gaps.max() < 0.7 * prepared.gaps.max()
    edges = prepared.edge_curves[prepared.coedge_edges]
    coedge = np.flatnonzero(edges >= 0).repeat(40)
    edge, face = prepared.coedge_edges[coedge], prepared.coedge_faces[coedge]
    low, high = prepared.edge_ranges[edge].T
    t = low + np.tile(np.linspace(0, 1, 40), len(coedge) // 40) * (high - low)
    points = prepared.curves.evaluate(prepared.edge_curves[edge], t)
    places = prepared.pcurves.evaluate(coedge, t)
    on_face = prepared.surfaces.evaluate(face, prepared.places.to_parameters(face, places))
    apart = np.linalg.norm(points - on_face, axis=1)
    assert (apart <= prepared.close_gaps[coedge]).all()
    assert (apart <= prepared.gaps[coedge]).all()


def spread_seam(document: dict[str, Any], apart: float) -> None:
    """Move an end of the period of the first curved face of a solid, along x."""
    nets = (face["surface"]["control_net"] for face in document["faces"])
    for point in next(net for net in nets if len(net) > 3)[-1]:
        point[0] += apart


@pytest.mark.parametrize("apart", [1e-9, 1e-6])
def test_the_gap_of_a_mesh_includes_a_seam_that_closes_only_nearly(apart: float) -> None:
    """One end of the period is on the seam edge, and the other as far from it as they are apart."""
    document = read_solid("cylinder")
    before = mesh_gap(document)
    spread_seam(document, apart)
    assert before < 1e-10
    assert apart <= mesh_gap(document) <= 5 * apart


def mesh_gap(document: dict[str, Any]) -> float:
    """The proved gap of a mesh of a brep."""
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-2))
    mesh = build(lower(document), options)
    assert mesh.report is not None
    assert mesh.report.brep is not None
    return mesh.report.brep.gap_bound
