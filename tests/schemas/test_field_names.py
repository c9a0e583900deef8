"""The issue of an unknown field names the documented field with the most similar name."""

from typing import Any

import pytest

from service.errors import InvalidRequest
from service.schemas.convert import ConvertRequest
from service.schemas.fields import RequestModel
from service.schemas.kinds import KINDS
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document

NET = [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
SPLINE = {"type": "bspline", "control_net": NET, "degree": 1}


@pytest.mark.parametrize(
    ("model", "document", "pointer", "suggestion"),
    [
        (MeshRequest, {"surface": SPLINE, "resolutoin": 3}, "/resolutoin", "resolution"),
        (MeshRequest, {"surface": SPLINE | {"knot": "uniform"}}, "/surface/knot", "knots"),
        # A Bézier patch has no knots: the fields are those of the kind that the document names.
        (MeshRequest, {"surface": {"control_net": NET, "knot": 1}}, "/surface/knot", ""),
        # A name with more than 40 letters is not compared, which would take long.
        (MeshRequest, {"surface": SPLINE, "x" * 41: 1}, "/" + "x" * 41, ""),
        (
            ConvertRequest,
            {"surface": SPLINE, "operations": [{"op": "elevate", "degree": [2, 2], "degrees": 1}]},
            "/operations/0/degrees",
            "degree",
        ),
    ],
)
def test_the_issue_of_an_unknown_field_names_the_most_similar_field(
    model: type[RequestModel], document: dict[str, Any], pointer: str, suggestion: str
) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(model, document)
    (issue,) = refusal.value.issues
    needed = f"`{suggestion}`, or another documented name" if suggestion else "a documented name"
    assert (issue.code, issue.pointer, issue.needed) == ("unknown_field", pointer, needed)


@pytest.mark.parametrize(("name", "first"), [("Bspline", "bspline"), ("x" * 41, "bezier")])
def test_the_issue_of_an_unknown_kind_lists_the_most_similar_kind_first(
    name: str, first: str
) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, {"surface": {"type": name}})
    kinds = refusal.value.issues[0].needed.removeprefix("one of ").split(", ")
    assert (kinds[0], sorted(kinds)) == (first, sorted(KINDS))
