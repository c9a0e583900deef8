"""The numbers of faces and patches in requests: one member after the other."""

import numpy as np
import pytest

from service.engine.numbering import Numbering, count_numbers, list_numbers, number_patches
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.examples.catalogue import find
from service.surface.lowered import GroupModel
from tests.breps import PLATE, build_box


def lower_group(*surfaces: object) -> GroupModel:
    document = {"type": "group", "members": [{"surface": surface} for surface in surfaces]}
    model = validate_document(SurfaceRequest, {"surface": document}).to_surface().lower()
    assert isinstance(model, GroupModel)
    return model


SADDLE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}


def test_members_are_counted_one_after_the_other() -> None:
    model = lower_group(SADDLE, build_box(), PLATE, build_box(), SADDLE)
    numbering = Numbering.of(model)
    np.testing.assert_array_equal(numbering.starts, [0, 1, 7, 8, 14, 15])
    assert len(numbering) == 15
    copy, own = numbering.find_copies(np.arange(15))
    np.testing.assert_array_equal(copy, [0, *[1] * 6, 2, *[3] * 6, 4])
    np.testing.assert_array_equal(own, [0, *range(6), 0, *range(6), 0])


@pytest.mark.parametrize("name", ["gear", "rounded-box", "utah-teapot", "heated-panel"])
def test_a_model_alone_is_one_copy(name: str) -> None:
    model = find(name).surface().lower()
    assert not isinstance(model, GroupModel)
    numbering, numbers = Numbering.of(model), list_numbers(model)
    assert len(numbering) == count_numbers(model) == len(numbers)
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(numbers)))


def test_patches_of_a_group_have_their_numbers_in_the_request() -> None:
    model = find("tea-service").surface().lower()
    numbers = number_patches(model).request_numbers
    assert numbers is not None
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(Numbering.of(model))))
