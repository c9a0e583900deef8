"""Sections of a part by planes: those of its faces, and of its members without trims."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from service.engine.joining.join import join
from service.engine.options import MeshOptions
from service.engine.parts.part import Part
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.face_lines import FaceNets
from service.engine.parts.sections.section import FaceSections
from service.engine.sections.section import cut_surface
from service.engine.sections.values import Planes, Section, Sections
from service.surface.checks import Up
from service.surface.lowered import PatchModel


def cut_part(
    part: Part,
    planes: Planes,
    tolerance: float,
    allow: Callable[[int], None],
    *,
    name: str = "part",
    up: Up = "y",
) -> Sections:
    """Cut a part by planes.

    Parameters
    ----------
    tolerance : float
        Model units.
    allow : callable
        As for `cut_surface`.
    """
    count, bound = 0, 0.0
    sections = [Section((), np.zeros((0, 3)), np.zeros(0, np.intp)) for _ in range(len(planes))]

    def allow_more(pieces: int) -> None:
        allow(count + pieces)

    faces = FaceNets.of(part)
    if faces.is_face.any():
        search = FaceSections.of(faces, Borders.of(part), planes, tolerance, allow_more)
        sections = search.cut()
        bound, count = search.deviation, search.search.count
    patches = part.members.patches
    if patches is not None:
        joined, seams = join(patches, MeshOptions().weld_tolerance)
        others = cut_surface(joined, seams, planes, tolerance, allow_more)
        bound = max(bound, others.deviation_bound)
        sections = [
            _join(joined, one, two) for one, two in zip(sections, others.sections, strict=True)
        ]
    return Sections(name, up, planes, tuple(sections), bound)


def _join(patches: PatchModel, faces: Section, others: Section) -> Section:
    """The section of faces and of patches by one plane."""
    numbers = patches.request_numbers
    assert numbers is not None  # the patches of a part are numbered
    coplanar = np.unique(np.concatenate([faces.coplanar, numbers[others.coplanar]]))
    return replace(
        faces,
        polylines=faces.polylines + others.polylines,
        touching=np.concatenate([faces.touching, others.touching]),
        coplanar=coplanar,
    )
