"""Entities of STEP files: points and directions, supertypes, and what they cost."""

import numpy as np
import pytest

from service.decoders.step.budget import FREE_CHARACTERS, MAX_READINGS
from service.decoders.step.faults import Fault
from service.errors import InvalidRequest
from tests.decoders.step.written import find_entities


@pytest.mark.parametrize(
    ("record", "expected"),
    [
        ("CARTESIAN_POINT('',(1.,2.,3.))", (1.0, 2.0, 3.0)),
        ("CARTESIAN_POINT ( 'it''s' , ( 1.E1 ,\n-2. , .5 ) )", (10.0, -2.0, 0.5)),
        ("cartesian_point('',(1.,2.))", (1.0, 2.0, 0.0)),
        ("CARTESIAN_POINT($,(1.))", (1.0, 0.0, 0.0)),
        ("(CARTESIAN_POINT((1.,2.,3.))POINT()REPRESENTATION_ITEM(''))", (1.0, 2.0, 3.0)),
    ],
)
def test_points(record: str, expected: tuple[float, float, float]) -> None:
    entities = find_entities(f"#1={record};")
    assert entities.point(1) == expected
    np.testing.assert_array_equal(entities.points([1] * 5), [expected] * 5)


@pytest.mark.parametrize(
    "record",
    [
        "CARTESIAN_POINT('',(1.,2.,nan))",
        "CARTESIAN_POINT('',(1.,,3.))",
        "CARTESIAN_POINT('',(1.,2.,1.E13))",
        "CARTESIAN_POINT('',(1.,inf,1.))",
        "CARTESIAN_POINT('',(1.,2.,$))",
        "CARTESIAN_POINT('')",
        "CARTESIAN_POINT('',#1)",
        "DIRECTION('',(1.,2.,3.))",
    ],
)
def test_malformed_points(record: str) -> None:
    entities = find_entities(f"#1={record};#2=CARTESIAN_POINT('',(0.,0.,0.));")
    with pytest.raises(Fault):
        entities.point(1)
    with pytest.raises(Fault):
        entities.points([2, 2, 1, 2])
    with pytest.raises(Fault, match="no entity #3"):
        entities.points([2, 2, 3, 2])


def test_directions() -> None:
    entities = find_entities("#1=DIRECTION('',(0.,3.,4.));#2=direction($,(1.,0.));#3=A();")
    assert entities.direction(1) == (0.0, 3.0, 4.0)
    assert entities.direction(2) == (1.0, 0.0, 0.0)
    with pytest.raises(Fault, match="#3 is not a DIRECTION"):
        entities.direction(3)


def test_complex_instances_have_the_parameters_of_simple_ones() -> None:
    entities = find_entities(
        "#1=EDGE_CURVE('e',#2,#3,#4,.T.);"
        "#2=(EDGE_CURVE(#4,.T.)EDGE(#2,#3)REPRESENTATION_ITEM('e')TOPOLOGICAL());#3=(B()A(1));"
    )
    assert entities.read(1).parameters == entities.read(2).parameters
    assert entities.read(2).keyword == "EDGE_CURVE"
    assert entities.read(3).keyword == "A+B"
    with pytest.raises(Fault, match="missing"):
        entities.read(1).parameter(5)


def test_parsing_is_paid_for() -> None:
    data = f"#1=A('{'x' * 100_000}');"
    entities = find_entities(data)
    allowed = (MAX_READINGS * len(data) + FREE_CHARACTERS) // len(data)
    for _ in range(allowed):
        entities.read(1)
    with pytest.raises(InvalidRequest) as error:
        entities.points([1, 1])
    assert error.value.issues[0].code == "too_costly"
