r"""Strings of STEP files: apostrophes, control directives, and bytes beyond ASCII."""

import pytest

from service.decoders.step.strings import decode_string


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", "plain"),
        ("an ''apostrophe''", "an 'apostrophe'"),
        (r"Gr\X\F6\X\DFe", "Größe"),
        (r"\X2\03B103B2\X0\ and \X2\4E2D\X0\.", "αβ and 中."),
        (r"\X4\0001F600\X0\!", "😀!"),
        (r"\X2\D83DDE00\X0\!", "😀!"),
        (r"\S\v", "ö"),
        (r"\PE\\S\P", "а"),  # ISO 8859-5 at 0xD0
        (r"C:\\temp", r"C:\temp"),
        (r"two\N\lines", "two lines"),
        (r"left \open", r"left \open"),
        (r"odd \X2\00F\X0\ digits", "odd  digits"),
        (r"half \X2\D83D\X0\ a pair", "half \ufffd a pair"),
        ("line\r\n ends", "line ends"),
        ("tab\tand nul\0", "tab and nul "),
    ],
)
def test_directives(text: str, expected: str) -> None:
    assert decode_string(text) == expected


def test_bytes_are_utf_8_or_latin_1() -> None:
    assert decode_string("Größe".encode().decode("latin-1")) == "Größe"
    assert decode_string("Größe") == "Größe"
