"""Triangular patches in a browser: three.js in headless Chromium draws the served GLB."""

from tests.web.browser import Stage


def test_three_draws_a_smooth_box(server: str, stage: Stage) -> None:
    stage.show(f"{server}/v1/surfaces/rounded-box/mesh.glb?resolution=4")
    (mesh,) = stage.meshes()
    assert mesh["triangles"] == 18 * 32 + 8 * 16
    assert mesh["longestNormalError"] < 1e-6
