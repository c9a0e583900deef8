"""The global section."""

import pytest

from service.decoders.iges.header import read_header


def write_header(**values: str) -> str:
    words = {
        "between": "1H,", "end": "1H;", "name": "4Hpart", "file": "8Hpart.igs",
        "system": "9HCAD, 1; x", "processor": "3H1.0", "integer": "32", "single": "38",
        "digits": "6", "double": "308", "double_digits": "15", "receiver": "4Hpart",
        "scale": "1.", "unit": "2", "unit_name": "2HMM", "weights": "1", "width": "0.1",
        "date": "15H20260101.000000", "resolution": "1.D-5", "largest": "100.", "author": "0H",
        "organization": "", "version": "11", "standard": "0", "changed": "15H20260101.000000",
    } | values  # fmt: skip
    return ",".join(words.values()) + ";"


def test_strings_may_have_delimiters() -> None:
    header = read_header(write_header())
    assert header.delimiters == (",", ";")
    assert header.name == "part"
    assert header.system == "CAD, 1; x"
    assert header.schema == "IGES 5.3"
    assert header.resolution == 1e-5
    assert (header.unit, header.metres_per_unit) == ("millimetre", 0.001)


def test_the_name_of_the_system_is_no_name_of_a_product() -> None:
    header = read_header(write_header(name="3HCAD", system="3HCAD"))
    assert (header.name, header.system) == ("", "CAD")
    header = read_header(write_header(name="3H1.0", system=""))
    assert (header.name, header.system) == ("", "1.0")


def test_delimiters_may_be_other_signs() -> None:
    text = write_header(between="1H/", end="1H$", system="3Ha/b")
    text = "1H//1H$/" + text[len("1H/,1H$,") : -1].replace(",", "/") + "$"
    header = read_header(text)
    assert header.delimiters == ("/", "$")
    assert (header.name, header.system, header.metres_per_unit) == ("part", "a/b", 0.001)


@pytest.mark.parametrize("text", [",,4Hpart,", ",1H;,4Hpart,", "1H,,,4Hpart,", "1H,,1H;,4Hpart,"])
def test_delimiters_may_be_left_out(text: str) -> None:
    header = read_header(text + "1Hf,1Hs,1Hp,32,38,6,308,15,,1.,6,1HM;")
    assert header.delimiters == (",", ";")
    assert (header.name, header.metres_per_unit) == ("part", 1.0)


@pytest.mark.parametrize(
    ("unit", "name", "metres"),
    [
        ("1", "2HIN", 0.0254),
        ("3", "2HFT", 0.3048),
        ("3", "4Hinch", 0.0254),
        ("3", "2HCM", 0.01),
        ("3", "7Hfurlong", None),
        ("4", "", 0.3048),
        ("5", "", 1609.344),
        ("7", "", 1000.0),
        ("8", "", 2.54e-5),
        ("9", "", 1e-6),
        ("10", "", 0.01),
        ("11", "", 2.54e-8),
        ("", "2HMM", 0.001),
        ("", "", 0.0254),
        ("nonsense", "", 0.0254),
    ],
)
def test_units_have_numbers_or_names(unit: str, name: str, metres: float | None) -> None:
    header = read_header(write_header(unit=unit, unit_name=name))
    assert header.metres_per_unit == metres
    assert header.unit == ("furlong" if metres is None else header.unit) != ""


def test_the_scale_divides_the_unit() -> None:
    # A scale of 1/8: a unit of the file is eight millimetres.
    assert read_header(write_header(scale="0.125")).metres_per_unit == pytest.approx(0.008)


def test_damaged_values_have_their_defaults() -> None:
    header = read_header(write_header(resolution="NaN", version="x", scale="-1"))
    assert header.resolution == 0.0
    assert header.schema == "IGES 2.0"
    assert header.metres_per_unit == 0.001
    assert read_header("").metres_per_unit == 0.0254
