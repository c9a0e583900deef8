"""Reads what a writer has written, and measures it."""

from collections.abc import Iterable

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import CadContent, Curve, Part
from service.decoders.cad.splines import evaluate, find_domain
from service.decoders.format import FileLimits
from service.decoders.iges.read import read
from service.decoders.iges.readers import Readers
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.iges.writing import Writer


def build_readers(writer: Writer) -> Readers:
    return Readers.of(writer.file(), FileLimits(max_control_points=100_000))


def sample(curve: Curve, count: int = 9) -> FloatArray:
    return evaluate(curve, np.linspace(*find_domain(curve), count))


def read_all(writer: Writer, **limits: int) -> CadContent:
    return read(writer.content(), FileLimits(**limits))


def list_parts(content: CadContent) -> list[Part]:
    return [part for definition in content.definitions for part in definition.parts]


def list_reasons(content: CadContent) -> dict[str, str]:
    return {face.entity: face.reason for face in content.reading.skipped_faces}


def assert_closed(part: Part, expected: float) -> None:
    """Assert that the mesh of a part has no cracks, and this volume."""
    found, cracks = measure_part(part)
    assert not cracks
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def find_names(parts: Iterable[Part]) -> list[str]:
    return [part.name for part in parts]
