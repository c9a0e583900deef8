"""Tubes and curves in a browser: three.js in headless Chromium draws the GLB."""

import numpy as np

from service.encoders.curves.registry import CURVES_BY_NAME
from service.engine.curves.options import CurveOptions
from service.pipeline.curve import render_curve
from service.surface.swept_shapes import trefoil
from tests.web.browser import Stage


def test_three_draws_a_smooth_knot(server: str, stage: Stage) -> None:
    stage.show(f"{server}/v1/surfaces/trefoil-tube/mesh.glb?resolution=6")
    (mesh,) = stage.meshes()
    assert mesh["triangles"] == 24 * 6 * 24 * 2
    assert mesh["longestNormalError"] < 1e-6
    # Its axis is z, and z is up: seen from the front the knot is three times as wide as high.
    low, high = (np.array(mesh["positions"]).min(axis=0), np.array(mesh["positions"]).max(axis=0))
    assert (high - low)[1] < (high - low)[0] / 2


def test_three_reads_a_curve(stage: Stage) -> None:
    stage.show(render_curve(trefoil(), CurveOptions(resolution=4), CURVES_BY_NAME["glb"]))
    (line,) = stage.lines()
    assert line["type"] == "Line"
    assert len(line["positions"]) == 97
    assert {"_arc_length", "_parameter", "_tangent", "position"} == set(line["attributes"])
    assert stage.page.evaluate("window.viewer.measure()")["coverage"] > 0
