"""Judges groups: the bounds of stretched copies, and tolerances in pixels of a camera.

Every group has three surfaces, one of them twice, with random affine matrices. It is meshed once by
tolerance and once for a camera. The file is JSON, which stores the vertices of all copies in
coordinates of the group. A sheet is a member as the oracles sample it (`oracles.sheets`).
"""

import time
from math import tan

import numpy as np

from oracles.deviation import measure_seen_deviation
from oracles.sheets import PlacedSheet, Sheet, build_sheets
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy, Camera
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.group import GroupSurface
from service.surface.member import Member
from tools.certify.seams import SeamReport, check_deviation
from tools.certify.surfaces import FAMILIES, Array, Random
from tools.certify.written import Written, read_file

KINDS = "bicubic, wild", "NURBS", "rational triangles", "poles", "creases", "quadrics", "flat"
"""Families of `tools.certify.surfaces` whose surfaces are members of groups."""

COUNT = 40
"""Number of groups that `make certify` judges."""

PIXELS = 2.0
"""The tolerance for the camera."""

MIN_DISTANCE = 1e-3
"""A share of the diagonal. The service treats points that are nearer to the camera as if they were
at this distance, and so does the judge."""


def judge_group(seed: int, relative: float) -> SeamReport:
    """The findings about both meshes of a group; deviations are compared copy by copy.

    `relative` is the tolerance of the first mesh, relative to the diagonal of the group.
    """
    rng = np.random.default_rng(seed)
    group, sheets = build_group(rng)
    seam_report = SeamReport(kind="groups", seed=seed, tolerance=relative)
    points = np.concatenate([s.at(s.samples(2000)) + s.origin for s in sheets])
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    position = tuple((points[0] + rng.uniform(-1, 1, 3) * size).tolist())
    camera = Camera(position, field_of_view=0.8, height=600)
    try:
        start = time.process_time()
        mesh = _write_mesh(group, Accuracy(relative_tolerance=relative))
        camera_mesh = _write_mesh(group, Accuracy(camera=camera, pixel_tolerance=PIXELS))
        seam_report.seconds = time.process_time() - start
    except Exception as error:  # any error means that no mesh was made
        seam_report.faults.append(f"{type(error).__name__}: {error}")
        return seam_report
    seam_report.triangles = len(mesh.faces)
    # The tolerance is relative to the diagonal of the control points, which is larger than the
    # diagonal of the samples, but by less than a factor of 4.
    seam_report.tolerance = relative * 4 * size
    check_deviation(seam_report, sheets, mesh, "member", 2000)
    # A ratio is that of a deviation to the distance from the eye.
    max_ratio = PIXELS * 2 * tan(camera.field_of_view / 2) / camera.height
    eye = np.array(camera.position)
    ratio = measure_seen_deviation(sheets, camera_mesh.corners, eye, MIN_DISTANCE * 4 * size, 1000)
    if not ratio <= max_ratio * (1 + 1e-9):
        seam_report.faults.append(
            f"deviates by {ratio / max_ratio * PIXELS} pixels, allowed {PIXELS}"
        )
    return seam_report


def _write_mesh(group: GroupSurface, accuracy: Accuracy) -> Written:
    """The mesh of a group, written as JSON and read back."""
    options = MeshOptions(accuracy=accuracy, normals=False)
    return read_file("json", render(group, options, BY_NAME["json"]))


def build_group(rng: Random) -> tuple[GroupSurface, list[Sheet]]:
    """A group of three random surfaces, the first of them twice; and the sheet of each member."""
    kinds = rng.choice(KINDS, size=3, replace=False)
    surfaces = [FAMILIES[kind].surface(int(rng.integers(1000))) for kind in kinds]
    members: list[Member] = []
    sheets: list[Sheet] = []
    for k, surface in enumerate([surfaces[0], *surfaces]):
        matrix = _draw_matrix(rng)
        members.append(Member(surface, name=f"member {k}", matrix=matrix))
        sheets += [PlacedSheet(sheet, matrix) for sheet in build_sheets(surface)]
    return GroupSurface(tuple(members)), sheets


def _draw_matrix(rng: Random) -> Array:
    """A random affine matrix (4, 4): rotations or reflections, a shift, and in half of the cases a
    scaling of each axis by 0.1 to 10."""
    matrix = np.eye(4)
    scaling = np.diag(10 ** rng.uniform(-1, 1, 3)) if rng.integers(2) else np.eye(3)
    orthogonal = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    matrix[:3, :3] = next(orthogonal) @ scaling @ next(orthogonal)
    matrix[:3, 3] = rng.uniform(-3, 3, 3)
    return matrix
