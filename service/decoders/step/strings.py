r"""Strings of an exchange structure: apostrophes, control directives and bytes beyond ASCII.

References
----------
ISO 10303-21, clause 6.4.3: `\X\` with two hexadecimal digits is a character of ISO 8859-1;
`\X2\` and `\X4\` with groups of four and eight digits, up to `\X0\`, are characters of ISO 10646;
`\S\` adds 128 to the character after it, in the part of ISO 8859 that `\P.\` names; `\N\` and
`\F\` end lines and pages in text.
"""

import codecs
import re

_DIRECTIVE = re.compile(
    r"\\X2\\([0-9A-Fa-f]*+)(?:\\X0\\)?"
    r"|\\X4\\([0-9A-Fa-f]*+)(?:\\X0\\)?"
    r"|\\X\\([0-9A-Fa-f]{2})"
    r"|\\S\\(.)"
    r"|\\P([A-I])\\"
    r"|\\([NF])\\"
    r"|\\\\",
    re.DOTALL,
)
# All codecs are looked up before a file is read: a child process cannot load them any more.
_TWO_BYTES, _FOUR_BYTES = codecs.lookup("utf-16-be"), codecs.lookup("utf-32-be")
_PARTS = [codecs.lookup(f"iso8859-{part}") for part in range(1, 10)]
_LINE_ENDS = re.compile(r"[\r\n]+")
_CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f]+")


def decode_string(text: str) -> str:
    """The text of a string.

    Many systems write UTF-8 or Latin-1 bytes as they are: bytes beyond ASCII that are valid UTF-8
    are read as such, others as Latin-1.

    Parameters
    ----------
    text : str
        The string between its apostrophes; each character is one byte of the file (Latin-1).
    """
    text = text.replace("''", "'")
    if "\n" in text or "\r" in text:
        # A file may break its lines inside strings.
        text = _LINE_ENDS.sub("", text)
    if not text.isascii():
        text = _decode_bytes(text)
    if "\\" in text:
        text = _decode_directives(text)
    return _CONTROLS.sub(" ", text)


def _decode_bytes(text: str) -> str:
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeError:
        return text


def _decode_directives(text: str) -> str:
    part = 0

    def replace(match: re.Match[str]) -> str:
        nonlocal part
        two_bytes, four_bytes, one_byte, shifted, letter, line_end = match.groups()
        if two_bytes is not None:
            return _from_hexadecimal(two_bytes, 4, _TWO_BYTES)
        if four_bytes is not None:
            return _from_hexadecimal(four_bytes, 8, _FOUR_BYTES)
        if one_byte is not None:
            return chr(int(one_byte, 16))
        if shifted is not None:
            code = bytes([(ord(shifted) + 128) % 256])
            return _PARTS[part].decode(code, "replace")[0]
        if letter is not None:
            part = ord(letter) - ord("A")
            return ""
        return " " if line_end else "\\"

    return _DIRECTIVE.sub(replace, text)


def _from_hexadecimal(digits: str, group: int, codec: codecs.CodecInfo) -> str:
    whole = digits[: len(digits) - len(digits) % group]
    return codec.decode(bytes.fromhex(whole), "replace")[0]
