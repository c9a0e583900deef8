"""The readers of CAD files do in a child what they do in this process, and open no other file."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from service.decoders.child import read_file
from service.decoders.format import Decoded, Decoder, FileLimits
from service.decoders.registry import BY_NAME, BY_SUFFIX
from service.errors import InvalidRequest, SurfaceError
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.content_key import content_key
from service.surface.sizes import SurfaceKind
from tests.decoders.step.written import Writer, wrap

FOLDER = Path("tests/cad_files")
FILES = (
    "assembly_inch_ap203.step",
    "degrees_latin1.step",
    "faceted_cm.step",
    "loft_ap242.step",
    "mirrored_scaled.step",
    "bolt_brep_inch.igs",
    "mirrored_faces.igs",
    "plate_faces.igs",
    "torus_faces.igs",
)
"""Files that have all between them that readers do; each takes a process."""

_opened: list[str] | None = None


def _record(event: str, arguments: tuple[Any, ...]) -> None:
    if _opened is not None and event in {"open", "socket.connect", "subprocess.Popen"}:
        _opened.append(str(arguments[0]))


sys.addaudithook(_record)


@contextmanager
def opened_files() -> Iterator[list[str]]:
    """The files that Python opens in the `with` block."""
    global _opened  # noqa: PLW0603  (a hook cannot be removed)
    names: list[str] = []
    _opened = names
    try:
        yield names
    finally:
        _opened = None


def read_apart(decoder: Decoder, content: bytes) -> Decoded:
    """Reads a file in a child process, however short it is."""
    return read_file(replace(decoder, child_bytes=0), content, None, FileLimits())


def build(tree: dict[str, Any]) -> SurfaceKind:
    """The surface of a document."""
    return validate_document(SurfaceRequest, {"surface": tree}).to_surface()


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_a_child_reads_what_this_process_reads(name: str) -> None:
    path = FOLDER / name
    decoder, content = BY_SUFFIX[path.suffix[1:]], path.read_bytes()
    expected, got = decoder.decode(content, None, FileLimits()), read_apart(decoder, content)
    assert content_key(build(got.tree)) == content_key(build(expected.tree))
    assert got.reading == expected.reading


def test_files_that_a_file_names_are_never_opened(tmp_path: Path) -> None:
    secret = tmp_path / "part.step"
    secret.write_bytes(b"secret")
    writer = Writer()
    writer.tetrahedron()
    for name in (str(secret), "../../etc/passwd", "http://127.0.0.1:9/part.step"):
        writer(f"DOCUMENT_FILE('{name}','',$,$,'',$)")
        writer(f"EXTERNAL_SOURCE(IDENTIFIER('{name}'))")
    content = wrap(writer.data)
    with opened_files() as opened:
        decoded = BY_NAME["step"].decode(content, None, FileLimits())
    assert [name for name in opened if not name.endswith((".py", ".pyc"))] == []
    assert decoded.reading is not None
    assert decoded.reading["unfollowed_references"] >= 3
    assert read_apart(BY_NAME["step"], content).reading == decoded.reading


@pytest.mark.parametrize(
    ("content", "error"),
    [
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", InvalidRequest),
    ],
)
def test_an_error_in_a_child_is_that_in_this_process(
    content: bytes, error: type[SurfaceError]
) -> None:
    with pytest.raises(error) as here:
        BY_NAME["step"].decode(content, None, FileLimits())
    with pytest.raises(error) as apart:
        read_apart(BY_NAME["step"], content)
    assert apart.value.issues == here.value.issues


@pytest.mark.slow
def test_many_faces_in_few_bytes_fit_into_the_memory_of_a_child() -> None:
    """3,200 faces in 170 bytes each: files of other systems have ten times as many."""
    writer = Writer()
    for number in range(800):
        writer.tetrahedron(number + 1.0)
    content = wrap(writer.data)
    assert len(content) < 170 * 3_200
    decoded = read_apart(BY_NAME["step"], content)
    assert decoded.reading is not None
    assert decoded.reading["faces"] == 3_200
