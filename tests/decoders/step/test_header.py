"""The header of STEP files: schema and writing system."""

import pytest

from service.decoders.format import FileLimits
from service.decoders.step.entities import Entities
from service.decoders.step.header import Header, read_header
from tests.decoders.step.written import HEADER, wrap


def read(header: str) -> Header:
    return read_header(Entities(wrap("#1=A();", header), FileLimits()))


def test_schema_and_system() -> None:
    assert read(HEADER) == Header("AUTOMOTIVE_DESIGN", "system 2.0")


def test_the_preprocessor_stands_for_a_missing_system() -> None:
    header = "file_name('','',(''),(''),'writer 1.0',' ','');file_schema(('a','B'));"
    assert read(header) == Header("A, B", "writer 1.0")


def test_names_in_strings_are_no_statements() -> None:
    header = "FILE_NAME('FILE_SCHEMA((''X''))','',(''),(''),'','it''s','');FILE_SCHEMA(('Y'));"
    assert read(header) == Header("Y", "it's")


@pytest.mark.parametrize(
    "header", ["", "FILE_SCHEMA((", "FILE_NAME();FILE_SCHEMA(());", "FILE_SCHEMA($);"]
)
def test_malformed_headers(header: str) -> None:
    assert read(header) == Header("", "")


def test_many_malformed_statements_take_linear_time() -> None:
    assert read("FILE_NAME(" * 50_000) == Header("", "")
