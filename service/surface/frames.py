"""Frames of members of a group: their placements, multiplied with those of their parents."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.errors import InvalidRequest, Issue, pointer
from service.surface.checks import MAX_COORDINATE
from service.surface.placement import is_valid_linear, validate_matrix

MAX_DEPTH = 100
"""The most levels of members, one below another."""


@dataclass(frozen=True, eq=False, slots=True)
class Frames:
    """The frames of M members: a member has its surface, and the members below it, in its frame.

    Attributes
    ----------
    matrices : ndarray of float64, shape (M, 4, 4)
        The placements in the group: the product of the matrices of the member and all above it.
    levels : ndarray of int, shape (M,)
        Number of these matrices that are not the identity.
    stretches, reaches : ndarray of float64, shape (M,)
        Upper bounds of the product of their largest scalings, and of Σ s_k |t_k| over these
        matrices: t_k is the translation of a matrix, and s_k the product of the scalings of those
        above it. For bounds of rounding errors.
    """

    matrices: FloatArray
    levels: Ints
    stretches: FloatArray
    reaches: FloatArray


def find_depths(parents: Sequence[int | None]) -> Ints:
    """The number of members above each member.

    Raises
    ------
    InvalidRequest
        `unknown_parent` unless a parent is an earlier member; `too_deep`.
    """
    depths: list[int] = []
    for number, parent in enumerate(parents):
        if parent is None:
            depths.append(0)
            continue
        if not 0 <= parent < number:
            code = "unknown_parent"
            message = "A parent is a member before its members, so that there are no circles."
            needed = f"0 to {number - 1}" if number else "no parent for the first member"
            raise _refuse(number, "parent", code, message, (f"member {parent}", needed))
        depths.append(depths[parent] + 1)
        if depths[-1] == MAX_DEPTH:
            message = "Members are nested more deeply than this service places."
            got, needed = f"more than {MAX_DEPTH} levels", f"at most {MAX_DEPTH}"
            raise _refuse(number, "parent", "too_deep", message, (got, needed))
    return np.array(depths, np.intp)


def multiply_frames(
    matrices: Sequence[FloatArray | None], parents: Sequence[int | None], depths: Ints
) -> Frames:
    """The frames of members with these placements; None stands for the identity.

    Raises
    ------
    InvalidRequest
        `not_finite`, `out_of_range` or `singular_matrix`: of a product of placements.
    """
    count = len(matrices)
    given = np.array([matrix is not None for matrix in matrices], bool)
    own = np.broadcast_to(np.eye(4), (count, 4, 4)).copy()
    if given.any():
        own[given] = np.array([matrix for matrix in matrices if matrix is not None])
    scalings = np.ones(count)
    # The factor makes the computed scaling an upper bound.
    scalings[given] = np.linalg.svd(own[given, :3, :3], compute_uv=False)[:, 0] * (1 + 2.0**-40)
    shifts = np.linalg.norm(own[:, :3, 3], axis=1) * (1 + 2.0**-40)
    frames, levels = own.copy(), given.astype(np.intp)
    stretches, reaches = scalings, shifts.copy()
    above = np.array([-1 if parent is None else parent for parent in parents], np.intp)
    order = np.argsort(depths, kind="stable")
    ends = np.searchsorted(depths[order], np.arange(1, int(depths.max()) + 2))
    with np.errstate(over="ignore", invalid="ignore"):
        for first, last in pairwise(ends.tolist()):
            rows = order[first:last]
            up = above[rows]
            frames[rows] = _multiply(frames[up], own[rows])
            levels[rows] += levels[up]
            reaches[rows] = reaches[up] + stretches[up] * shifts[rows]
            stretches[rows] *= stretches[up]
    _check_products(frames, depths > 0, matrices)
    for array in (frames, levels, stretches, reaches):
        array.flags.writeable = False
    return Frames(frames, levels, stretches, reaches)


def _multiply(first: FloatArray, second: FloatArray) -> FloatArray:
    """The products of matrices (N, 4, 4); equal matrices give equal bits, wherever they are."""
    terms = [first[:, :, k, np.newaxis] * second[:, np.newaxis, k] for k in range(4)]
    # −0 becomes 0, so that equal placements have equal bytes.
    return terms[0] + terms[1] + terms[2] + terms[3] + 0.0


def _check_products(
    frames: FloatArray, is_product: Bools, matrices: Sequence[FloatArray | None]
) -> None:
    """Refuse a product of placements that cannot be a placement itself."""
    rows = np.flatnonzero(is_product)
    if not len(rows):
        return
    # False for NaN, too.
    is_within = np.asarray((np.abs(frames[rows]) <= MAX_COORDINATE).all(axis=(1, 2)), np.bool_)
    is_right = is_within.copy()
    is_right[is_within] = is_valid_linear(frames[rows[is_within], :3, :3])
    for number in rows[~is_right].tolist():
        name = "parent" if matrices[number] is None else "matrix"
        try:
            validate_matrix(frames[number])
        except InvalidRequest as error:
            issue = replace(error.issues[0], pointer=pointer(("members", number, name)))
            raise InvalidRequest(issue) from None


def _refuse(
    number: int, name: str, code: str, message: str, texts: tuple[str, str]
) -> InvalidRequest:
    return InvalidRequest(Issue(code, message, pointer(("members", number, name)), *texts))
