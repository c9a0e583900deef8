"""Units of length in STEP files.

References
----------
ISO 10303-41: si_unit, conversion_based_unit.
"""

from service.encoders.cad.step_records import Records, write_real
from service.encoders.units import match_unit

PREFIXES = {1e-9: ".NANO.", 1e-6: ".MICRO.", 1e-3: ".MILLI.", 0.01: ".CENTI.", 0.1: ".DECI.",
            1.0: "$", 1e3: ".KILO."}  # fmt: skip
"""The prefixes of a metre, by their factors."""

UNITS = {0.0254: "INCH", 0.3048: "FOOT", 0.9144: "YARD", 1609.344: "MILE"}
"""Other units of length, in metres."""


def write_unit(records: Records, metres: float) -> int:
    """The number of a unit of length."""
    add = records.add
    known = match_unit(metres, (*PREFIXES, *UNITS)) or metres
    if known in PREFIXES:
        return add(f"(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT({PREFIXES[known]},.METRE.))")
    metre = add("(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.))")
    measure = f"LENGTH_MEASURE({write_real(known)})"
    factor = add(f"LENGTH_MEASURE_WITH_UNIT({measure},#{metre})")
    exponents = add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
    name = UNITS.get(known, "UNIT")
    return add(
        f"(CONVERSION_BASED_UNIT('{name}',#{factor}) LENGTH_UNIT() NAMED_UNIT(#{exponents}))"
    )
