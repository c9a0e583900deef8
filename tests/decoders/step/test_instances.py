"""Instances of STEP files: where each begins and ends, whatever is between them."""

import contextlib

import pytest

from service.decoders.format import FileLimits
from service.decoders.step.instances import Instances
from service.errors import InvalidRequest, MalformedBody, TooLarge
from tests.decoders.step.written import wrap

LIMITS = FileLimits()


def find(data: str) -> Instances:
    return Instances(wrap(data), LIMITS)


def texts(instances: Instances) -> dict[int, str]:
    """The text of each instance up to its last parenthesis."""
    found = {}
    for row, number in enumerate(instances.numbers.tolist()):
        start, end = instances.span(row)
        text = instances.text[start:end]
        found[number] = text[: text.rindex(")") + 1].strip()
    return found


def test_instances_over_lines_and_several_in_one() -> None:
    data = "#1=A(#2\n,\n#3);#2 = B('x');\r\n\t#30\n=\nC ( 1. ) ;"
    assert texts(find(data)) == {1: "A(#2\n,\n#3)", 2: "B('x')", 30: "C ( 1. )"}


def test_signs_in_strings_are_no_instances() -> None:
    data = "#1=A('#2=B();');\n#3=A('it''s #4=C() /* ');\n#5=D('*/');"
    assert list(texts(find(data))) == [1, 3, 5]


def test_comments_may_have_apostrophes_and_instances() -> None:
    data = "/* don't */#1=A('/*');/* #2=B(); */\n#3=/* ' */C(/**/1)/***/;#4=D('*/');"
    assert texts(find(data)) == {1: "A('/*')", 3: "C( 1)", 4: "D('*/')"}


def test_a_comment_may_not_end() -> None:
    assert list(texts(find("#1=A();/* #2=B(); "))) == [1]


def test_a_missing_semicolon_loses_nothing() -> None:
    assert texts(find("#1=A(#2)\n#2=B(1)\n#3=C();")) == {1: "A(#2)", 2: "B(1)", 3: "C()"}


def test_a_missing_apostrophe_loses_one_instance() -> None:
    found = find("#1=A('a');\n#2=B('b);\n#3=C('c');\n#4=D('d');")
    assert found.numbers.tolist() == [1, 2, 3, 4]


def test_several_data_sections() -> None:
    data = "#1=A();\nENDSEC;\nDATA('two',('B'));\n#2=B();"
    assert list(texts(find(data))) == [1, 2]


def test_data_in_the_header() -> None:
    content = wrap("#1=A();", header="FILE_NAME('ENDSEC; DATA; #9=X();','',(''),(''),'','','');\n")
    instances = Instances(content, LIMITS)
    assert instances.numbers.tolist() == [1]
    assert "FILE_NAME" in instances.header


def test_keywords_of_simple_and_complex_instances() -> None:
    found = find("#1=point();#2=(B('x(')A(#1));#3=POINT();#4=<file.stp#1>;#5=(A());")
    assert [found.keyword(row) for row in range(3)] == ["POINT", "(", "POINT"]
    assert found.rows_of("POINT") == [0, 2]
    assert found.rows_of("A", "POINT") == [0, 1, 2, 4]
    assert found.keywords == {"POINT", "(", "?", "A", "B"}
    assert found.count_external() == 1


@pytest.mark.parametrize("numbers", [[3, 1, 2], [10**17, 5, 10**12]])
def test_instances_are_found_by_number(numbers: list[int]) -> None:
    found = find("".join(f"#{number}=A();" for number in numbers))
    assert [found.find(number) for number in numbers] == [0, 1, 2]
    assert found.find(0) == found.find(4) == found.find(-1) == found.find(10**18) == -1


def test_of_equal_numbers_the_first_counts() -> None:
    assert find("#1=A();#2=B();#1=C();").find(1) == 0
    assert find("#1=A();#900000=B();#1=C();").find(1) == 0


def test_numbers_may_have_zeros_in_front_but_not_too_many_digits() -> None:
    assert find("#007=A();").numbers.tolist() == [7]
    assert find(f"#{'9' * 18}=A();#{'9' * 19}=B();").numbers.tolist() == [10**18 - 1]


def test_chunks_of_a_long_file() -> None:
    count = 300_000
    found = find("".join(f"#{n}=A('={n}');\n" for n in range(1, count + 1)))
    assert found.numbers.tolist() == list(range(1, count + 1))


def test_too_many_entities() -> None:
    content = wrap("#1=A();#2=A();#3=A();")
    Instances(content, FileLimits(max_entities=3))
    with pytest.raises(TooLarge) as error:
        Instances(content, FileLimits(max_entities=2))
    (issue,) = error.value.issues
    assert (issue.code, issue.needed) == (
        "too_many_entities",
        "at most 2 (SURFACE_MAX_FILE_ENTITIES)",
    )


@pytest.mark.parametrize("content", [b"", b"solid\n"])
def test_no_step_file(content: bytes) -> None:
    """Such files have the error that those of other formats have."""
    with pytest.raises(MalformedBody) as error:
        Instances(content, LIMITS)
    assert error.value.issues[0].code == "malformed_body"


@pytest.mark.parametrize("content", [b"ISO-10303-21;\nHEADER;\n", wrap("")])
def test_no_instances(content: bytes) -> None:
    with pytest.raises(InvalidRequest) as error:
        Instances(content, LIMITS)
    assert error.value.issues[0].code == "malformed_file"


@pytest.mark.parametrize("text", ["/*", "'", "=", "#1=", "#1 ", "(", "''", "/* '"])
def test_hostile_repetitions_take_linear_time(text: str) -> None:
    content = wrap(text * (2_000_000 // len(text)) + "#1=A();")
    with contextlib.suppress(InvalidRequest):
        Instances(content, LIMITS)


@pytest.mark.parametrize("numbers", [[3, 1, 2], [10**17, 5, 10**12]])
def test_many_instances_are_found_at_once(numbers: list[int]) -> None:
    found = find("".join(f"#{number}=A();" for number in numbers))
    wanted = [*numbers, -1, 0, 4, 10**18, numbers[0]]
    assert found.find_all(wanted).tolist() == [0, 1, 2, -1, -1, -1, -1, 0]
