"""Units of STEP files: SI units, chains of conversions, and uncertainties."""

from math import pi

import pytest

from service.decoders.format import FileLimits
from service.decoders.step.entities import Entities
from service.decoders.step.units import UnitReader, Units
from tests.decoders.step.written import Writer, wrap

EXPONENTS = "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)"


def read_units(writer: Writer, context: str) -> Units:
    entities = Entities(wrap(writer.data), FileLimits())
    return UnitReader(entities).read_context(int(context[1:]))


def convert(writer: Writer, name: str, value: float, base: str, kind: str = "LENGTH") -> str:
    """A conversion-based unit."""
    measure = writer(f"{kind}_MEASURE_WITH_UNIT({kind}_MEASURE({value}),{base})")
    exponents = writer(EXPONENTS)
    return writer(
        f"(CONVERSION_BASED_UNIT('{name}',{measure}){kind}_UNIT()NAMED_UNIT({exponents}))"
    )


@pytest.mark.parametrize(
    ("prefix", "metres", "name"),
    [
        ("$", 1.0, "metre"),
        (".MILLI.", 1e-3, "millimetre"),
        (".CENTI.", 1e-2, "centimetre"),
        (".KILO.", 1e3, "kilometre"),
        (".MICRO.", 1e-6, "micrometre"),
    ],
)
def test_si_units(prefix: str, metres: float, name: str) -> None:
    writer = Writer()
    units = read_units(writer, writer.context(writer.unit(prefix)))
    assert (units.metres, units.name, units.radians) == (metres, name, 1.0)


def test_a_simple_record_of_an_si_unit() -> None:
    writer = Writer()
    units = read_units(writer, writer.context(writer("SI_UNIT(*,.MILLI.,.METRE.)")))
    assert units.metres == 1e-3


@pytest.mark.parametrize(
    ("name", "value", "prefix", "metres", "expected"),
    [
        ("INCH", 25.4, ".MILLI.", 0.0254, "inch"),
        ("zoll", 0.0254, "$", 0.0254, "inch"),
        ("FOOT", 304.8, ".MILLI.", 0.3048, "foot"),
        ("ELLE", 0.667, "$", 0.667, "elle"),
    ],
)
def test_conversion_based_units(
    name: str, value: float, prefix: str, metres: float, expected: str
) -> None:
    writer = Writer()
    unit = convert(writer, name, value, writer.unit(prefix))
    units = read_units(writer, writer.context(unit))
    assert units.metres == pytest.approx(metres, rel=1e-15)
    assert units.name == expected


def test_a_chain_of_conversions() -> None:
    writer = Writer()
    inch = convert(writer, "INCH", 25.4, writer.unit())
    foot = convert(writer, "FOOT", 12, inch)
    yard = convert(writer, "MY YARD", 3, foot)
    units = read_units(writer, writer.context(yard))
    assert units.metres == pytest.approx(0.9144, rel=1e-15)
    assert units.name == "yard"


def test_degrees() -> None:
    writer = Writer()
    radian = writer("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    degree = convert(writer, "DEGREE", 0.0174532925199433, radian, "PLANE_ANGLE")
    units = read_units(writer, writer.context(writer.unit(), degree))
    assert units.radians == pytest.approx(pi / 180, rel=1e-12)
    assert units.metres == 1e-3


def test_uncertainty_in_a_unit_of_its_own() -> None:
    writer = Writer()
    inch = convert(writer, "INCH", 25.4, writer.unit())
    small = writer(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-5),{inch},'','')")
    large = writer(
        f"(LENGTH_MEASURE_WITH_UNIT()MEASURE_WITH_UNIT(LENGTH_MEASURE(0.001),{writer.unit()})"
        "UNCERTAINTY_MEASURE_WITH_UNIT('',''))"
    )
    angle = writer(f"UNCERTAINTY_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(1.),{inch},'','')")
    context = writer.context(inch, uncertainty=f"{small},{angle},{large}")
    units = read_units(writer, context)
    assert units.uncertainty == pytest.approx(1e-6)
    assert units.factor(1e-3) == pytest.approx(25.4)
    assert Units().factor(1e-3) == units.factor(None) == 1.0


@pytest.mark.parametrize(
    "unit",
    [
        "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.GRAM.))",
        "(CONTEXT_DEPENDENT_UNIT('x')LENGTH_UNIT()NAMED_UNIT(*))",
        "(CONVERSION_BASED_UNIT('x',#1)LENGTH_UNIT()NAMED_UNIT(*))",  # of itself
        "(CONVERSION_BASED_UNIT('x',#99)LENGTH_UNIT()NAMED_UNIT(*))",
        "SI_UNIT()",
        "A(",
    ],
)
def test_units_of_other_quantities_and_malformed_ones(unit: str) -> None:
    writer = Writer()
    first = writer(unit)
    assert read_units(writer, writer.context(first)).metres is None


def test_a_circle_of_units_ends() -> None:
    writer = Writer()
    writer("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.),#2)")
    unit = writer("(CONVERSION_BASED_UNIT('x',#1)LENGTH_UNIT()NAMED_UNIT(*))")
    assert read_units(writer, writer.context(unit)).metres is None


@pytest.mark.parametrize("value", ["0.", "-1.", "1.E300", "1.E-400", "1.E10"])
def test_units_that_are_out_of_range(value: str) -> None:
    writer = Writer()
    base = writer.unit("$")
    measure = writer(f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),{base})")
    unit = writer(f"(CONVERSION_BASED_UNIT('x',{measure})LENGTH_UNIT()NAMED_UNIT(*))")
    assert read_units(writer, writer.context(unit)).metres is None


def test_a_missing_context() -> None:
    entities = Entities(wrap("#1=A();"), FileLimits())
    assert UnitReader(entities).read_context(None) == Units()
    assert UnitReader(entities).read_context(7) == Units()
