"""Reads an IGES file: its faces and solids as parts, in products that are placed.

References
----------
IGES 5.3: Initial Graphics Exchange Specification, US PRO (1996).
"""

import numpy as np

from service.decoders.cad.content import CadContent, Placement
from service.decoders.format import FileLimits, check_entities, check_faces
from service.decoders.iges.directory import read_directory
from service.decoders.iges.entities import IgesFile
from service.decoders.iges.header import read_header
from service.decoders.iges.readers import Readers
from service.decoders.iges.references import find_owned, find_reached
from service.decoders.iges.report import Report
from service.decoders.iges.sections import find_sections
from service.decoders.iges.solids import FACE
from service.decoders.iges.structure import ROOT_TYPES, Structure
from service.decoders.iges.surfaces import TYPES as SURFACES
from service.decoders.iges.trimmed import FACES

INDEPENDENT = frozenset({0, 2})
"""Switches of entities that do not belong to another one."""

BOUNDED_PLANE = 108, 1
"""Type and form of a plane that is a face."""

UNSEEN = frozenset({0, 124, 308, 314, 402, 404, 406, 410})
"""Types that are no part of a surface: matrices, subfigures, colours, groups, properties, drawings
and views."""

REFERENCE = 416
"""The type of references to other files."""


def read(content: bytes, limits: FileLimits) -> CadContent:
    """The parts of an IGES file.

    Raises
    ------
    MalformedBody
        `malformed_file`: the file is not IGES in its fixed format.
    TooLarge, InvalidRequest
        `too_many_entities`, `too_many_faces`, `too_many_control_points`.
    """
    sections = find_sections(content)
    check_entities(len(sections.directory) // 2, limits)
    header = read_header(sections.global_text)
    file = IgesFile(header, read_directory(sections.directory), sections.parameters)
    check_faces(int(np.isin(file.directory.types, [*FACES, FACE]).sum()), limits)
    owned = find_owned(file)
    roots = _find_roots(file, owned)
    is_surface = [file.type(number) in SURFACES for number in roots]
    check_faces(sum(is_surface), limits)
    report = Report()
    structure = Structure(Readers.of(file, limits), report)
    root = structure.read_level(header.name, roots)
    _count_skipped(file, report, owned, structure.used)
    return CadContent(
        tuple(structure.definitions),
        (Placement(root),),
        report.write(header, len(structure.definitions)),
        header.metres_per_unit,
    )


def _find_roots(file: IgesFile, owned: set[int]) -> list[int]:
    """The entities that may be in the surface and belong to no other one."""
    directory = file.directory
    roots = []
    for row in np.flatnonzero(np.isin(directory.types, [*ROOT_TYPES])).tolist():
        number, kind = 2 * row + 1, int(directory.types[row])
        if number in owned:
            continue
        if kind in SURFACES:
            # A surface that belongs to something else that is not read is no face.
            is_face = kind != BOUNDED_PLANE[0] or directory.forms[row] == BOUNDED_PLANE[1]
            if not is_face or int(directory.subordinate[row]) not in INDEPENDENT:
                continue
        roots.append(number)
    return roots


def _count_skipped(file: IgesFile, report: Report, owned: set[int], used: set[int]) -> None:
    """Count the entities that stand for themselves and are not in the surface."""
    directory = file.directory
    known = find_reached(file, used) | owned
    for row, kind in enumerate(directory.types.tolist()):
        number = 2 * row + 1
        if kind == REFERENCE:
            report.unfollowed_references += 1
            continue
        is_independent = int(directory.subordinate[row]) in INDEPENDENT
        if is_independent and kind not in UNSEEN and number not in known:
            report.skipped_entities[f"type {kind}"] += 1
