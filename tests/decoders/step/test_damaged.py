"""Damaged STEP files: each is read, with a report, or refused; nothing else happens."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from service.decoders.cad.document import write_document
from service.decoders.format import FileLimits
from service.decoders.step.read import read
from service.errors import SurfaceError
from tools.fuzz.cad_mutations import build_hostile, damage

CONTENTS = [path.read_bytes() for path in sorted(Path("tests/cad_files").glob("*.step"))]
HOSTILE = [content for _, content in build_hostile() if b"ISO-10303" in content[:4096]]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_damaged_files(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for content in CONTENTS:
        for _ in range(3):
            with suppress(SurfaceError):
                write_document(read(damage(content, rng), FileLimits()))


@pytest.mark.slow
@pytest.mark.parametrize("content", HOSTILE)
def test_hostile_files(content: bytes) -> None:
    with suppress(SurfaceError):
        write_document(read(content, FileLimits()))


def test_all_faces_are_in_the_result_or_in_the_report() -> None:
    """References of faces are changed, one at a time; the file has 15 faces."""
    content = CONTENTS[0]
    text = content.decode("latin-1")
    begins = [k for k in range(len(text)) if text.startswith("ADVANCED_FACE('',(#", k)]
    assert len(begins) == 15
    for begin in begins:
        damaged = f"{text[:begin]}ADVANCED_FACE('',(#9{text[begin + 19 :]}"
        reading = read(damaged.encode("latin-1"), FileLimits()).reading
        assert reading.faces + len(reading.skipped_faces) == 15
        assert len(reading.skipped_faces) == 1
