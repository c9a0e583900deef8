"""Parts of parameter curves over single patches: they cover the curves and stay in their spans."""

import numpy as np
from hypothesis import given

from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.knot_cuts import cut_at_knots
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from tests.engine.trims.tables import seeds
from tests.engine.trims.test_gaps import COUNT, build_case


@given(seeds)
def test_parts_cover_the_curves(seed: int) -> None:
    table, _, pcurve_table = build_case(seed)
    surfaces = ClosedSurfaces.open(FaceSurfaces.of(table))
    pcurves = Splines.of(pcurve_table)
    spans = pcurves.list_spans()
    parts = cut_at_knots(surfaces, np.arange(COUNT), pcurves, spans)
    for k in range(len(spans.curve)):
        rows = (parts.source == k).nonzero()[0]
        assert parts.low[rows[0]] == spans.low[k]
        assert parts.high[rows[-1]] == spans.high[k]
        np.testing.assert_array_equal(parts.low[rows[1:]], parts.high[rows[:-1]])


@given(seeds)
def test_parts_stay_in_their_spans(seed: int) -> None:
    table, _, pcurve_table = build_case(seed)
    surfaces = ClosedSurfaces.open(FaceSurfaces.of(table))
    pcurves = Splines.of(pcurve_table)
    parts = cut_at_knots(surfaces, np.arange(COUNT), pcurves, pcurves.list_spans())
    domain = surfaces.period[parts.curve].T
    # Parts that touch a knot line are very short.
    short = parts.high - parts.low < 1e-9
    assert (parts.excess <= 1e-12 * domain)[:, ~short].all()
    assert (parts.excess <= 1e-6 * domain).all()
    for share in (0.0, 0.3, 0.7, 1.0):
        t = parts.low + share * (parts.high - parts.low)
        places = pcurves.evaluate(parts.curve, t).T
        assert (places >= parts.knots[:, 0] - parts.excess - 1e-12).all()
        assert (places <= parts.knots[:, 1] + parts.excess + 1e-12).all()
