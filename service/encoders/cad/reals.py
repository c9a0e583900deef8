"""Reals as text, as STEP and IGES write them."""

import re

from service.bases.arrays import FloatArray
from service.encoders.text import json_array

_EXPONENT = re.compile(r"(?<![\d.])(\d+)e", re.ASCII)


def list_reals(numbers: FloatArray, mark: str) -> str:
    """The numbers of an array (n,), separated by commas; `mark` is the letter before exponents."""
    return mark_exponents(json_array(numbers)[1:-1].decode(), mark)


def mark_exponents(text: str, mark: str) -> str:
    """Write 1e-07 as 1.E-07, with E for `mark`; Python and orjson leave out this point."""
    return _EXPONENT.sub(r"\1.e", text).replace("e", mark) if "e" in text else text
