"""Cubic nets near nets of high degree, and bounds of the distance between the two.

The triangular net of a tensor net of degree (p, q) has (p+q+1)(p+q+2)/2 points, each a sum of many
terms. Above a certain degree it is cheaper to use a net V of degree at most (3, 3) that is near the
net W over the box about the triangle: the least-squares net in the Bernstein basis with the same
ends of every row and column. W − E V, with E V the net V elevated, bounds the distance.

Triangles in one box share V and its error, so triangles are sorted by their boxes.

Proof in docs/proofs.md: "Degree reduction".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein, elevation_matrix
from service.bases.cache import BASES
from service.engine.nets.blossoms import apply_along, build_blossoms
from service.engine.vectors import project

DIRECT = 8
"""Up to this degree p + q the nets of triangles are computed directly, without reduction."""

LOW = 3
"""Degree to which nets are reduced."""

SHIFT = 2.0**-40
"""Bound of the rounding in the bound of |S − S'|. If weights differ, it is multiplied by their
ratio."""


def sort_by_box(patch: Ints, parameters: FloatArray) -> Ints:
    """An order of triangles (3, 2, m) of patches (m,) in which equal boxes are neighbours."""
    return np.lexsort((*parameters.max(axis=0), *parameters.min(axis=0), patch))


def reduce_boxes(
    nets: FloatArray, patch: Ints, parameters: FloatArray
) -> tuple[Ints, FloatArray, FloatArray, FloatArray]:
    """Nets over the B different boxes about triangles in the order of `sort_by_box`.

    Parameters
    ----------
    nets : ndarray of float64, shape (P, D, p+1, q+1)
        Nets of different patches, no coordinate above 1.
    patch : ndarray of int, shape (m,)
        The patch of each triangle, in ascending order.
    parameters : ndarray of float64, shape (3, 2, m)
        The corners of the triangles.

    Returns
    -------
    box : ndarray of int, shape (m,)
        The box of each triangle.
    whole : ndarray of float64, shape (B, D, p+1, q+1)
        The nets over the boxes.
    low : ndarray of float64, shape (B, D, min(p, 3)+1, min(q, 3)+1)
        Nets of low degree that are near the nets over the boxes.
    gap : ndarray of float64, shape (B,)
        Bounds of the distance between the surfaces of both nets at equal parameters.
    """
    # The least and the greatest parameters of each triangle; which triangles begin a new box.
    ends = np.array([parameters.min(axis=0), parameters.max(axis=0)])
    is_new = np.ones(len(patch), dtype=bool)
    is_new[1:] = (patch[1:] != patch[:-1]) | (ends[..., 1:] != ends[..., :-1]).any(axis=(0, 1))
    first = is_new.nonzero()[0]
    along_u, along_v = (
        _build_matrices(count - 1, ends[:, axis, first])
        for axis, count in enumerate(nets.shape[2:])
    )
    box_nets = apply_along(nets[patch[first]], along_u, along_v)
    return np.cumsum(is_new) - 1, box_nets, *_reduce_nets(box_nets)


def _build_matrices(degree: int, intervals: FloatArray) -> FloatArray:
    """Matrices (m, n+1, n+1) that restrict nets of curves to intervals (2, m)."""
    order = np.lexsort(intervals)
    ordered = intervals.take(order, axis=1)
    is_new = np.ones(len(order), np.bool_)
    np.not_equal(ordered[:, 1:], ordered[:, :-1]).any(axis=0, out=is_new[1:])
    which = np.empty(len(order), np.intp)
    which[order] = is_new.cumsum() - 1
    different = ordered.take(is_new.nonzero()[0], axis=1)
    return build_blossoms(degree, different).take(which, axis=0)


def _reduce_nets(boxes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nets of low degree near nets over boxes, and bounds (B,) of the distances between both."""
    homogeneous = boxes.shape[1] == 4
    if homogeneous:
        corner = boxes[:, :3, :1, :1] / boxes[:, 3:, :1, :1]
        boxes = boxes.copy()
        boxes[:, :3] -= boxes[:, 3:] * corner
    low, p, q = boxes, boxes.shape[2] - 1, boxes.shape[3] - 1
    if p > LOW:
        low = _build_reduction(p) @ low
    if q > LOW:
        low = low @ _build_reduction(q).T
    raised = low
    if p > LOW:
        raised = elevation_matrix(LOW, p) @ raised
    if q > LOW:
        raised = raised @ elevation_matrix(LOW, q).T
    difference = (boxes - raised).reshape(*boxes.shape[:2], -1)
    difference *= difference
    point_error = np.sqrt((difference[:, 0] + difference[:, 1] + difference[:, 2]).max(axis=1))
    # `SHIFT` includes the rounding of corners of triangles to parameters of the box.
    if not homogeneous:
        return low, point_error + SHIFT
    weight_error = np.sqrt(difference[:, 3].max(axis=1))
    least, most = low[:, 3].min(axis=(1, 2)), low[:, 3].max(axis=(1, 2))
    is_positive = least > 0
    least = np.where(is_positive, least, 1.0)
    low[:, 3] = np.where(is_positive[:, np.newaxis, np.newaxis], low[:, 3], 1.0)
    low_points = project(low, -3)
    # max ‖S' − C‖
    size = np.sqrt((low_points * low_points).sum(axis=1).max(axis=(1, 2)))
    error = point_error + weight_error * size
    gap = error / boxes[:, 3].min(axis=(1, 2)) + SHIFT * (most / least)
    low[:, :3] += low[:, 3:] * corner
    return low, np.where(is_positive, gap, np.inf)


def _build_reduction(degree: int) -> FloatArray:
    """Matrix (4, n+1) from a net of degree n to the nearest net of degree 3 with the same ends."""

    def build() -> FloatArray:
        t = np.arange(4 * degree + 1) / (4 * degree)
        fine, coarse = bernstein(degree, t), bernstein(LOW, t)
        # `coarse` times the matrix is near `fine`; its first and last rows, `ends`, are given.
        ends = np.zeros((2, degree + 1))
        ends[0, 0] = ends[1, -1] = 1.0
        target = fine - coarse[:, [0, -1]] @ ends
        inner = np.linalg.lstsq(coarse[:, 1:-1], target, rcond=None)[0]
        return np.concatenate([ends[:1], inner, ends[1:]])

    return BASES.array(("reduction", degree), build)
