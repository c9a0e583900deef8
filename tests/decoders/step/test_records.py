"""Records of STEP files: lists, types, and values that are read when they are asked for."""

import pytest

from service.decoders.step.faults import Fault
from service.decoders.step.records import (
    MAX_COMMAS,
    MAX_NESTING,
    Parameter,
    Typed,
    as_enumeration,
    as_flag,
    as_integer,
    as_list,
    as_number,
    as_numbers,
    as_reference,
    as_references,
    as_text,
    find_references,
    parse_record,
)


def test_simple_records() -> None:
    record = parse_record("line ( 'a, b', #12,\n(1., .5E-3,-2),$ ,*, .T.) ; #13=(")
    assert record == {"LINE": ["'a, b'", "#12", ["1.", ".5E-3", "-2"], "$", "*", ".T."]}


def test_complex_records_have_their_types_in_any_order() -> None:
    record = parse_record("(NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.)LENGTH_UNIT());")
    assert record == {"NAMED_UNIT": ["*"], "SI_UNIT": [".MILLI.", ".METRE."], "LENGTH_UNIT": []}


def test_parameters_may_have_types() -> None:
    ((value, unit),) = parse_record("MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#7)").values()
    assert value == Typed("LENGTH_MEASURE", ["25.4"])
    assert as_number(value) == 25.4
    assert as_reference(unit) == 7


def test_strings_may_have_parentheses_apostrophes_and_semicolons() -> None:
    record = parse_record("A('(;) ''x'' /* no comment */', \"0F\", '');")
    assert [as_text(each) for each in record["A"]] == ["(;) 'x' /* no comment */", "", ""]


def test_a_semicolon_may_be_missing() -> None:
    assert parse_record("A(#1,(2,3))\nENDSEC;\n") == {"A": ["#1", ["2", "3"]]}


@pytest.mark.parametrize(
    "text", ["", ";", "A", "A(", "A((1,2)", "(A()", "()", "(1,2)", "#1", "'A'()", ")A("]
)
def test_malformed_records(text: str) -> None:
    with pytest.raises(Fault):
        parse_record(text)


def test_lists_are_nested_to_a_limit() -> None:
    depth = MAX_NESTING - 1
    parse_record(f"A{'(' * depth}{')' * depth}")
    with pytest.raises(Fault, match="nested"):
        parse_record(f"A{'(' * 1_000_000}")


def test_values() -> None:
    assert as_references(["#1", "#20"]) == [1, 20]
    assert as_numbers(["1", "-2.5E1", ".5"]) == [1, -25, 0.5]
    assert as_numbers([Typed("PARAMETER_VALUE", ["2."])]) == [2]
    assert as_integer("3.") == 3
    assert [as_flag(each) for each in (".T.", ".F.", ".f.", ".U.")] == [True, False, False, True]
    assert as_enumeration(".bOth.") == "BOTH"
    assert as_enumeration("$") == ""
    assert as_text(Typed("LABEL", ["'a'"])) == "a"
    assert as_text("$") == ""
    assert as_text("'" + 5000 * "a" + "'") == 1000 * "a"
    nested: list[Parameter] = ["#1", ["'#2'", ["#3", Typed("A", ["#4"])]], "5"]
    assert find_references(nested) == [1, 3, 4]


@pytest.mark.parametrize("parameter", ["#", "#x", "12", "$", "'#1'", [], Typed("A", ["#1"])])
def test_no_references(parameter: str) -> None:
    with pytest.raises(Fault):
        as_reference(parameter)


@pytest.mark.parametrize("parameter", ["nan", "inf", "1e400", "#1", "$", "1,5", "''", ["1"]])
def test_no_numbers(parameter: str) -> None:
    with pytest.raises(Fault):
        as_number(parameter)
    with pytest.raises(Fault):
        as_numbers([parameter])


def test_no_other_values() -> None:
    with pytest.raises(Fault):
        as_integer("1.5")
    with pytest.raises(Fault):
        as_flag(".X.")
    with pytest.raises(Fault):
        as_enumeration("1")
    with pytest.raises(Fault):
        as_list("#1")


def test_lists_are_long_to_a_limit() -> None:
    with pytest.raises(Fault, match="too long"):
        parse_record(f"A({'#1,' * (MAX_COMMAS + 1)}#1);")


@pytest.mark.parametrize(
    "text",
    [
        "A('',#1,\n #2 );",
        "a( 'x''y' , ( #1 , #2 ) )",
        "A('',(),.T.)",
        "A('',(#1),.T.,$);",
        "A('',1.)",
    ],
)
def test_usual_records_are_parsed_as_others(text: str) -> None:
    others = parse_record(text.replace("(", "(B(0),", 1))
    ((keyword, parameters),) = parse_record(text).items()
    assert others == {keyword: [Typed("B", ["0"]), *parameters]}
