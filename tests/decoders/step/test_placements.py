"""Placements and transformations of STEP files."""

from math import sqrt

import numpy as np
import pytest

from service.decoders.cad.faults import InvalidGeometry
from service.decoders.step.placements import map_between, read_frame, read_matrix
from tests.decoders.step.written import Writer, find_entities

EYE = np.eye(4)


def matrix_of(writer: Writer, placement: str, factor: float = 1.0) -> np.ndarray:
    return read_matrix(find_entities(writer.data), int(placement[1:]), factor)


def test_axis2_placement_3d() -> None:
    writer = Writer()
    frame = writer.frame((1, 2, 3), (0, 0, 2), (1, 1, 5))
    half = sqrt(0.5)
    rows = [[half, -half, 0, 10], [half, half, 0, 20], [0, 0, 1, 30], [0, 0, 0, 1]]
    expected = np.array(rows)
    np.testing.assert_allclose(matrix_of(writer, frame, 10.0), expected, atol=1e-15)


def test_omitted_axes() -> None:
    writer = Writer()
    origin = writer.point(1, 2, 3)
    for record in (f"('',{origin},$,$)", f"('',{origin},$)", f"('',{origin},*,*)"):
        matrix = matrix_of(writer, writer(f"AXIS2_PLACEMENT_3D{record}"))
        np.testing.assert_array_equal(matrix[:, 3], [1, 2, 3, 1])
        np.testing.assert_array_equal(matrix[:3, :3], np.eye(3))


def test_axes_of_length_zero_count_as_omitted() -> None:
    writer = Writer()
    np.testing.assert_array_equal(matrix_of(writer, writer.frame(z=(0, 0, 0), x=(0, 0, 0))), EYE)


def test_other_placements() -> None:
    writer = Writer()
    origin = writer.point(1, 2, 3)
    axis = writer(f"AXIS1_PLACEMENT('',{origin},{writer.direction(0, 1, 0)})")
    plane = writer(f"AXIS2_PLACEMENT_2D('',{writer.point(4, 5)},{writer.direction(0, 1)})")
    entities = find_entities(writer.data)
    assert read_frame(entities, int(axis[1:])).z == (0, 1, 0)
    frame = read_frame(entities, int(plane[1:]))
    assert (frame.origin, frame.x, frame.y) == ((4, 5, 0), (0, 1, 0), (-1, 0, 0))
    with pytest.raises(InvalidGeometry, match="CARTESIAN_POINT, which is not read"):
        read_frame(entities, int(origin[1:]))


@pytest.mark.parametrize("names", ["''", "'','',''"])
def test_an_operator_mirrors_and_scales(names: str) -> None:
    writer = Writer()
    x, y, z = (writer.direction(*each) for each in ((-1, 0, 0), (0, 1, 0), (0, 0, 1)))
    origin = writer.point(30, 0, 0)
    operator = writer(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D({names},{x},{y},{origin},2.,{z})")
    np.testing.assert_allclose(
        matrix_of(writer, operator, 0.1),
        [[-2, 0, 0, 3], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]],
        atol=1e-15,
    )


def test_defaults_of_an_operator() -> None:
    writer = Writer()
    operator = writer(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,{writer.point(1, 0, 0)},$,$)")
    expected = EYE.copy()
    expected[0, 3] = 1
    np.testing.assert_array_equal(matrix_of(writer, operator), expected)


def test_a_complex_operator() -> None:
    writer = Writer()
    writer.point(0, 0, 0)
    operator = writer(
        "(CARTESIAN_TRANSFORMATION_OPERATOR($,$,#1,3.)CARTESIAN_TRANSFORMATION_OPERATOR_3D($)"
        "FUNCTIONALLY_DEFINED_TRANSFORMATION('','')REPRESENTATION_ITEM(''))"
    )
    # The record of the subtype has one attribute: the axis.
    np.testing.assert_array_equal(np.diag(matrix_of(writer, operator)), [3, 3, 3, 1])


@pytest.mark.parametrize("scale", ["0.", "-1.", "1.E-200", "1.E30", "'x'"])
def test_scales_out_of_range(scale: str) -> None:
    writer = Writer()
    origin = writer.point(0, 0, 0)
    operator = writer(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,{origin},{scale},$)")
    with pytest.raises(InvalidGeometry):
        matrix_of(writer, operator)


def test_the_map_between_two_placements() -> None:
    writer = Writer()
    source = matrix_of(writer, writer.frame((1, 2, 3), (0, 1, 0), (0, 0, 1)))
    target = 1.0 * matrix_of(writer, writer.frame((7, 0, 0), (1, 0, 0), (0, 0, -1)))
    target[:3, :3] *= 3.0
    matrix = map_between(source, target)
    assert matrix is not None
    np.testing.assert_allclose(matrix @ source, target, atol=1e-14)
    scaled = map_between(target, source)
    assert scaled is not None
    np.testing.assert_allclose(scaled @ target, source, atol=1e-14)
    assert map_between(EYE, EYE) is None
