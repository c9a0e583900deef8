"""Cancelled work ends at its next checkpoint, and does not affect later work."""

import pytest

from service.cancellation import Cancellation, Cancelled, cancelled_by
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.cost import Work
from service.pipeline.mesh import MeshFile, plan_mesh
from service.surface.examples.catalogue import find

WORKS = {
    "patches": ("utah-teapot", MeshOptions(resolution=(7, 7)), "glb"),
    "unequal": ("utah-teapot", MeshOptions(resolution=(5, 3)), "json"),
    "rational": ("sphere", MeshOptions(resolution=(9, 9), curvatures=True), "ply"),
    "triangles": ("octahedral-sphere", MeshOptions(resolution=(11, 11)), "obj"),
    "splines": ("bspline-hills", MeshOptions(resolution=(3, 3)), "off"),
    "forward": ("saddle", MeshOptions(resolution=(30, 30), method="forward_difference"), "glb"),
    "casteljau": ("saddle", MeshOptions(resolution=(30, 30), method="de_casteljau"), "glb"),
    "tubes": ("trefoil-tube", MeshOptions(resolution=(20, 20)), "stl"),
    "groups": ("tea-service", MeshOptions(resolution=(3, 3)), "gltf"),
    "tolerance": ("utah-teapot", MeshOptions(accuracy=Accuracy(relative_tolerance=0.01)), "glb"),
    "budget": ("monkey-saddle", MeshOptions(accuracy=Accuracy(max_triangles=90)), "glb"),
}


class CountingCancellation(Cancellation):
    """Counts the checkpoints of the work; the work may pass `allowed`, and is then cancelled."""

    def __init__(self, allowed: float = float("inf")) -> None:
        super().__init__()
        self.count = 0
        self._allowed = allowed

    def raise_if_over(self) -> None:
        """Counts this checkpoint, and cancels the work after the allowed number of them."""
        self.count += 1
        if self.count > self._allowed:
            self.cancel()
        super().raise_if_over()


def plan_example(kind: str) -> Work[MeshFile]:
    """The planned work of an entry of `WORKS`."""
    name, options, fmt = WORKS[kind]
    return plan_mesh(find(name).surface(), options, BY_NAME[fmt], EncodeOptions())


@pytest.mark.slow
@pytest.mark.parametrize("kind", WORKS)
def test_cancelled_work_stops_at_the_next_checkpoint_and_can_be_repeated(kind: str) -> None:
    expected = plan_example(kind).run().content
    counter = CountingCancellation()
    with cancelled_by(counter):
        assert plan_example(kind).run().content == expected
    assert counter.count >= 3
    for allowed in sorted({counter.count * quarter // 4 for quarter in range(4)}):
        cancellation = CountingCancellation(allowed)
        with cancelled_by(cancellation), pytest.raises(Cancelled):
            plan_example(kind).run()
        assert cancellation.count == allowed + 1, "the work continued after the cancellation"
    assert plan_example(kind).run().content == expected
