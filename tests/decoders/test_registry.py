"""Names, suffixes and media types are unique; files are known by how they begin."""

import io
import time

import numpy as np
import pytest

from service.decoders import registry
from service.decoders.format import (
    FileLimits,
    check_entities,
    check_faces,
    check_placed_faces,
)
from service.decoders.refused import REFUSED
from service.decoders.registry import BY_NAME, BY_SUFFIX, CAD_DECODERS, DECODERS, find_by_content
from service.errors import TooLarge

IGES = b"Made by hand".ljust(72) + b"S      1\r\n" + b"1H,,1H;".ljust(72) + b"G      1\r\n"


def _npy() -> bytes:
    file = io.BytesIO()
    np.save(file, np.zeros((2, 2, 3)))
    return file.getvalue()


def test_each_name_suffix_and_media_type_is_that_of_one_format() -> None:
    refused = [suffix for each in REFUSED for suffix in each.suffixes]
    for names in (
        [each.name for each in DECODERS],
        [suffix for each in DECODERS for suffix in each.suffixes] + refused,
        [each.media_type for each in DECODERS] + [m for each in REFUSED for m in each.media_types],
    ):
        assert len(set(names)) == len(names)
    assert BY_SUFFIX["stp"] is BY_SUFFIX["p21"] is BY_NAME["step"]
    assert BY_SUFFIX["igs"] is BY_NAME["iges"]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("step", b"ISO-10303-21;\nHEADER;"),
        ("step", b"\xef\xbb\xbf  \n/* by hand */ /**/\nISO-10303-21;"),
        ("iges", IGES),
        ("3dm", b"3D Geometry File Format        8"),
        ("npy", _npy()),
        (None, b"ISO-10303"),
        (None, b""),
        (None, b"{}"),
        (None, IGES.replace(b"S      1", b"G      1")),
    ],
)
def test_a_file_is_known_by_how_it_begins(name: str | None, content: bytes) -> None:
    found = find_by_content(content)
    assert (found and found.name) == name


def test_no_beginning_takes_long_to_look_at() -> None:
    start = time.process_time()
    for content in (b"/**/" * 10_000, b" " * 50_000, b"/*" * 20_000, b"*/ /*" * 9000):
        assert find_by_content(content) is None
    assert time.process_time() - start < 0.1


def test_long_files_of_cad_systems_are_read_in_a_child() -> None:
    for decoder in CAD_DECODERS:
        assert decoder.is_cad
        assert decoder.is_read_in_child(registry.CHILD_BYTES + 1)
    assert not BY_NAME["step"].is_read_in_child(registry.CHILD_BYTES)
    assert BY_NAME["3dm"].is_read_in_child(1)
    assert not BY_NAME["npy"].is_read_in_child(1 << 30)


def test_a_library_that_is_missing_is_named() -> None:
    decoder = BY_NAME["3dm"]
    issue = registry.unavailable_issue(decoder)
    assert "surface-service[rhino]" in issue.needed
    assert BY_NAME["step"].is_available()


def test_too_large_files_name_the_setting_to_raise() -> None:
    limits = FileLimits(max_entities=2, max_faces=3, max_placed_faces=4)
    for check, most, setting in (
        (check_entities, 2, "SURFACE_MAX_FILE_ENTITIES"),
        (check_faces, 3, "SURFACE_MAX_FACES"),
        (check_placed_faces, 4, "SURFACE_MAX_PLACED_FACES"),
    ):
        check(most, limits)
        with pytest.raises(TooLarge) as caught:
            check(most + 1, limits)
        (issue,) = caught.value.issues
        assert issue.needed == f"at most {most} ({setting})"
        assert issue.got.startswith(f"{most + 1} ")
