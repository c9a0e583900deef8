"""Reads STEP files: solids, shells and assemblies, and reports all that is left out."""

import numpy as np

from service.decoders.cad.content import CadContent, Placement
from service.decoders.format import FileLimits, check_faces
from service.decoders.step.assembly import Assembler
from service.decoders.step.entities import Entities
from service.decoders.step.header import read_header
from service.decoders.step.products import read_products
from service.decoders.step.report import write_report
from service.decoders.step.representations import Representations
from service.decoders.step.structure import find_structure
from service.decoders.step.styles import Styles
from service.decoders.step.tally import Tally
from service.decoders.step.unread import count_references, tally_unread

FACE_KEYWORDS = ("ADVANCED_FACE", "FACE_SURFACE")
"""Faces that are counted before any is read."""


def read(content: bytes, limits: FileLimits) -> CadContent:
    """Read a STEP file (ISO 10303-21 with AP203, AP214 or AP242).

    A broken entity is left out and reported. The depth of assemblies, and what their instances come
    to, is checked where they are written (`service.decoders.cad.document`): here each definition
    is made once.

    Raises
    ------
    InvalidRequest
        `malformed_file`: this is no STEP file, or it has no data; `too_many_control_points`,
        `too_costly`.
    TooLarge
        `too_many_entities`, `too_many_faces`.
    """
    with np.errstate(all="ignore"):  # numbers that are not finite are refused where they are used
        return _Reader(content, limits).read()


class _Reader:
    def __init__(self, content: bytes, limits: FileLimits) -> None:
        self._entities = Entities(content, limits)
        self._limits = limits
        self._tally = Tally()

    def read(self) -> CadContent:
        entities, tally = self._entities, self._tally
        rows = entities.instances.rows_of(*FACE_KEYWORDS)
        check_faces(len(rows), self._limits)
        header = read_header(entities)
        representations = Representations(entities)
        products = read_products(entities, tally)
        structure = find_structure(entities, products, representations, tally)
        assembler = Assembler(entities, representations, structure, Styles(entities), tally)
        definitions, roots = assembler.build()
        if not any(definition.parts for definition in definitions):
            definitions, roots = [assembler.build_loose()], [Placement(0)]
        tally_unread(entities, assembler.seen, tally)
        reading = write_report(
            header,
            definitions,
            assembler,
            representations.units,
            tally,
            products=len(products.products),
            references=count_references(entities),
        )
        return CadContent(tuple(definitions), tuple(roots), reading, assembler.metres)
