"""Control points with two coordinates are in the plane z = 0."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from service.errors import InvalidRequest
from service.schemas.arrays import NumberGrid
from service.schemas.bezier import CONTROL_NET
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document

SQUARE = [[[0, 0], [0, 1]], [[1, 0], [1, 2.5]]]
SURFACES: dict[str, dict[str, Any]] = {
    "bezier": {"control_net": SQUARE},
    "bspline": {"type": "bspline", "control_net": SQUARE, "degree": 1},
    "triangle": {"type": "triangle", "control_net": [[[0, 0], [1, 0]], [[0, 1]]]},
    "patches": {
        "type": "patches",
        "vertices": [[0, 0], [0, 1], [1, 0], [1, 2]],
        "patches": [[[0, 1], [2, 3]]],
    },
}


def in_space(value: Any) -> Any:
    """Nested lists with a third coordinate, 0, for each point of two."""
    if isinstance(value, list):
        is_point = all(isinstance(each, int | float) for each in value)
        return [*value, 0] if is_point and len(value) == 2 else [in_space(each) for each in value]
    return value


@pytest.mark.parametrize("kind", SURFACES)
def test_a_planar_net_is_the_net_with_z_0(kind: str) -> None:
    document = SURFACES[kind]
    field = "vertices" if kind == "patches" else "control_net"
    planar, spatial = (
        validate_document(MeshRequest, {"surface": {**document, field: net}}).to_surface().lower()
        for net in (document[field], in_space(document[field]))
    )
    (batch,), (expected,) = planar.batches, spatial.batches  # type: ignore[union-attr]
    assert batch.points.tobytes() == expected.points.tobytes()


def test_points_in_a_plane_and_in_space_are_not_mixed() -> None:
    for net, pointer in (
        ([[[0, 0], [0, 1]], [[1, 0], [1, 2, 3]]], "/surface/control_net/1/1"),
        ([[[0, 0, 0], [0, 1]], [[1, 0, 0], [1, 2, 3]]], "/surface/control_net/0/1"),
        ([[[0], [0]], [[1], [1]]], "/surface/control_net/0/0"),
    ):
        with pytest.raises(InvalidRequest) as refusal:
            validate_document(MeshRequest, {"surface": {"control_net": net}}).to_surface()
        issue = refusal.value.issues[0]
        assert (issue.code, issue.pointer) == ("wrong_dimension", pointer)


def test_an_array_may_be_planar_too() -> None:
    net = CONTROL_NET.array(np.array(SQUARE, dtype=np.float32))
    np.testing.assert_array_equal(net, np.array(in_space(SQUARE)))
    vectors = NumberGrid(("coordinates",), width=3)
    with pytest.raises(ValidationError, match="exactly three coordinates"):
        vectors.array(np.array([1.0, 2.0]))
