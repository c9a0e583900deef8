"""What a surface may carry beside its points, and what is refused at birth."""

from typing import Any

import numpy as np
import pytest

from service.errors import InvalidRequest
from service.surface.bezier import BezierSurface
from service.surface.channels import (
    MAX_ATTRIBUTES,
    MAX_DIMENSION,
    MAX_NUMBERS,
    Channels,
    only_channels,
)
from service.surface.checks import MAX_DEGREE
from service.surface.lowered import ChannelKind
from service.surface.patches import PatchSurface

SQUARE = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
ONE = np.ones((1, 1, 1))


def refused(**channels: Any) -> tuple[str, str]:
    """Code and pointer of the only issue."""
    with pytest.raises(InvalidRequest) as caught:
        BezierSurface(SQUARE, channels=Channels(**channels))
    (issue,) = caught.value.issues
    return issue.code, issue.pointer


@pytest.mark.parametrize(
    ("colors", "code", "pointer"),
    [
        ([[[1.0, 0]]], "wrong_dimension", "/colors"),
        ([[[1.0, 0, 0, 1, 0]]], "wrong_dimension", "/colors"),
        ([[[1.0, 0, 0], [1, 0, 1.5]]], "out_of_range", "/colors/0/1/2"),
        ([[[1.0, -0.01, 0]]], "out_of_range", "/colors/0/0/1"),
        ([[[1.0, np.nan, 0]]], "not_finite", "/colors/0/0/1"),
        (np.ones((1, 3)), "channel_shape", "/colors"),
        (np.ones((MAX_DEGREE + 2, 1, 3)), "degree_too_high", "/colors"),
        (np.ones((0, 1, 3)), "wrong_dimension", "/colors"),
    ],
)
def test_colors_that_are_none(colors: Any, code: str, pointer: str) -> None:
    assert refused(colors=np.array(colors)) == (code, pointer)


def test_texture_coordinates_that_are_none() -> None:
    assert refused(uvs=np.ones((2, 2, 3))) == ("wrong_dimension", "/uvs")
    assert refused(uvs=np.full((1, 1, 2), 1e39)[:, :, :1].repeat(2, axis=2) * [1, 0]) == (
        "coordinate_too_large",
        "/uvs/0/0/0",
    )


def test_attributes_that_are_none() -> None:
    wide = np.ones((1, 1, MAX_DIMENSION + 1))
    assert refused(attributes=(("a", wide),)) == ("wrong_dimension", "/attributes/a")
    infinite = np.full((1, 2, 1), [[[0.0], [np.inf]]])
    assert refused(attributes=(("a", infinite),)) == ("not_finite", "/attributes/a/0/1/0")


@pytest.mark.parametrize("name", ["", "1st", "_x", "a b", "ä", "a/b", "a" * 33, "a\n"], ids=repr)
def test_names_that_are_no_words(name: str) -> None:
    code, pointer = refused(attributes=((name, ONE),))
    assert code == "wrong_value"
    assert len(pointer) < 64


@pytest.mark.parametrize(
    ("names", "at"),
    [(("temp", "TEMP"), "TEMP"), (("flow", "Flow_0"), "Flow_0"), (("b_12", "b"), "b_12")],
)
def test_names_that_formats_could_not_tell_apart(names: tuple[str, ...], at: str) -> None:
    attributes = tuple((name, ONE) for name in names)
    assert refused(attributes=attributes) == ("name_clash", f"/attributes/{at}")


def test_names_that_formats_tell_apart() -> None:
    names = ("a", "A" * 32, "b_0", "b_1", "c_", "c_x", "d_0_1", "surface", "x")
    channels = Channels(attributes=tuple((name, ONE) for name in names))
    assert [name for name, *_ in channels.each()] == list(names)


def test_so_many_attributes_and_no_more() -> None:
    attributes = tuple((f"a{k}", ONE) for k in range(MAX_ATTRIBUTES + 1))
    assert len(Channels(attributes=attributes[1:]).attributes) == MAX_ATTRIBUTES
    assert refused(attributes=attributes) == ("wrong_length", "/attributes")


def test_one_value_a_vertex() -> None:
    vertices, index = SQUARE.reshape(4, 3), np.arange(4).reshape(1, 2, 2)
    for colors in (np.ones((3, 3)), np.ones((5, 3)), np.ones((2, 2, 3))):
        with pytest.raises(InvalidRequest) as caught:
            PatchSurface(vertices, index, channels=Channels(colors))
        assert [(i.code, i.pointer) for i in caught.value.issues] == [("channel_shape", "/colors")]


def test_a_small_document_makes_no_large_nets() -> None:
    """Few values, named by very many patches: refused before they are spread out."""
    vertices = SQUARE.reshape(4, 3)
    patches = np.zeros((MAX_NUMBERS // (4 * 16) + 1, 2, 2), dtype=np.int64)
    with pytest.raises(InvalidRequest) as caught:
        PatchSurface(vertices, patches, channels=Channels(attributes=(("a", np.ones((4, 16))),)))
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("too_many_values", "/attributes/a")
    fewer = Channels(attributes=(("a", np.ones((4, 15))),))
    assert PatchSurface(vertices, patches, channels=fewer).channels is fewer


def test_values_are_copied_and_read_only() -> None:
    given = np.zeros((1, 1, 3))
    colors = Channels(given).colors
    given[:] = 1
    assert colors is not None
    assert not colors.any()
    assert not colors.flags.writeable


def test_only_some_channels() -> None:
    channels = Channels(np.ones((1, 1, 3)), np.ones((1, 1, 2)), (("a", ONE), ("b", ONE)))
    model = BezierSurface(SQUARE, channels=channels).lower()
    assert only_channels(model, frozenset({"colors", "uvs", "attribute"})) is model
    cases: list[tuple[list[ChannelKind], list[str]]] = [
        (["attribute"], ["a", "b"]),
        (["uvs"], ["uvs"]),
        ([], []),
    ]
    for kinds, names in cases:
        (batch,) = only_channels(model, frozenset(kinds)).batches
        assert [channel.name for channel in batch.channels] == names
