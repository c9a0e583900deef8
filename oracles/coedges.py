"""Parameter curves of the coedges of a brep document, and curves of its edges."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from oracles.brep_documents import Net, Spline, read_curve, read_line
from oracles.feet import trace_edge


class Coedge(NamedTuple):
    """The parameter curve of a coedge.

    `is_reversed` is whether the loop runs against it, `is_traced` whether it was traced along the
    edge, instead of the one that is given.
    """

    curve: Spline
    is_reversed: bool
    is_traced: bool = False


def iterate_coedges(
    brep: dict[str, Any],
    face: dict[str, Any],
    loop: dict[str, Any],
    net: Net,
    flatness: float | None = 1e-4,
) -> Iterator[Coedge]:
    """The coedges of a loop; without `flatness`, none is traced."""
    edges, pcurves = loop.get("edges"), loop.get("pcurves")
    count = len(edges or pcurves or [])
    rows = zip(
        edges or [None] * count,
        pcurves or [None] * count,
        loop.get("reversed") or [False] * count,
        strict=True,
    )
    for edge, pcurve, is_reversed in rows:
        if pcurve is None:
            curve = _invert_parallelogram(net, read_edge(brep, edge), face)
            yield Coedge(curve, is_reversed)
            continue
        curve = read_curve(pcurve)
        if flatness is None or edge is None or brep["edges"][edge].get("degenerate"):
            yield Coedge(curve, is_reversed)
            continue
        space = read_edge(brep, edge)
        is_traced = _measure_gap(net, space, curve) > find_uncertainty(brep)
        if is_traced:
            size = np.ptp(curve.points, axis=0)
            size = np.maximum(size, 0.01 * np.ptp(net.domain, axis=1))
            curve = trace_edge(net, space, curve, flatness, size)
        yield Coedge(curve, is_reversed, is_traced)


def find_uncertainty(brep: dict[str, Any]) -> float:
    """The uncertainty of a brep document; the default is 1e-6 of the diagonal of its box."""
    if brep.get("uncertainty") is not None:
        return float(brep["uncertainty"])
    points = [np.array(brep["vertices"], dtype=np.float64).reshape(-1, 3)]
    points += [read_edge(brep, k).points for k, e in enumerate(brep["edges"]) if e.get("curve")]
    return 1e-6 * float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))


def _measure_gap(net: Net, space: Spline, curve: Spline) -> float:
    """Largest sampled distance of an edge from its parameter curve at the same parameters."""
    share = np.linspace(0, 1, 33)
    t, s = ((1 - share) * c.domain[0] + share * c.domain[1] for c in (curve, space))
    places = np.clip(curve.at(t).astype(np.float64), *net.domain.T)
    offset = net.at(places) - space.at(s)
    return float(np.sqrt((offset * offset).sum(axis=1)).max())


def read_edge(brep: dict[str, Any], number: int) -> Spline:
    """The curve in space of an edge; it is a line between its vertices if none is given."""
    edge = brep["edges"][number]
    if edge.get("curve") is not None:
        return read_curve(edge["curve"])
    start, end = (brep["vertices"][edge["vertices"][k]] for k in (0, -1))
    return read_line(start, end)


def _invert_parallelogram(net: Net, curve: Spline, face: dict[str, Any]) -> Spline:
    """The parameter curve of a curve in the plane of a bilinear surface that is a parallelogram."""
    corners = net.points.astype(np.longdouble)
    is_plane = net.degree == (1, 1) and corners.shape[:2] == (2, 2) and np.ptp(net.weights) == 0
    if (
        not is_plane
        or np.abs(corners[0, 0] - corners[0, 1] - corners[1, 0] + corners[1, 1]).max()
        > 1e-12 * net.diagonal
    ):
        raise ValueError(f"{face.get('name')}: no parameter curve")
    u, v = corners[1, 0] - corners[0, 0], corners[0, 1] - corners[0, 0]
    offset = curve.points.astype(np.longdouble) - corners[0, 0]
    uu, uv, vv, pu, pv = u @ u, u @ v, v @ v, offset @ u, offset @ v
    shares = np.stack([pu * vv - pv * uv, pv * uu - pu * uv], axis=1) / (uu * vv - uv * uv)
    domain = net.domain
    places = (domain[:, 0] + shares * np.ptp(domain, axis=1)).astype(np.float64)
    return Spline(curve.degree, curve.knots, places, curve.weights)
