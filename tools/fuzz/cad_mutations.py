"""Damages files of CAD systems, and builds hostile ones."""

import re
from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

Random: TypeAlias = np.random.Generator

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[EeDd][-+]?\d+)?")
_REFERENCE = re.compile(rb"#\d+")
_RECORD = re.compile(rb"#\d+\s*=[^;]*;\s*")
_KEYWORD = re.compile(rb"[A-Z_]{4,}")

EXTREMES = (
    b"0", b"-1", b"1", b"2", b"31", b"1000", b"999999999", b"1E308", b"-1E308", b"1E999", b"1E-320",
    b"NAN", b"INF", b"18446744073709551616", b"1E12", b"0.", b"1E-17", b"*", b"$", b"()", b"''",
)  # fmt: skip
"""Texts that stand in place of a number."""


def _pick(pattern: re.Pattern[bytes], content: bytes, rng: Random) -> re.Match[bytes] | None:
    """A match of the pattern, near a random place."""
    return pattern.search(content, int(rng.integers(len(content)))) if content else None


def cut(content: bytes, rng: Random) -> bytes:
    """The beginning of a file, or a file without a part of it."""
    first, last = np.sort(rng.integers(0, len(content) + 1, 2)).tolist()
    return content[:first] if rng.random() < 0.5 else content[:first] + content[last:]


def flip(content: bytes, rng: Random) -> bytes:
    """The file with some other bits."""
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 20))):
        changed[int(rng.integers(len(changed)))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def change_number(content: bytes, rng: Random) -> bytes:
    """The file with another number in one place or in several."""
    for _ in range(int(rng.integers(1, 5))):
        if match := _pick(_NUMBER, content, rng):
            value = EXTREMES[int(rng.integers(len(EXTREMES)))]
            content = content[: match.start()] + value + content[match.end() :]
    return content


def change_reference(content: bytes, rng: Random) -> bytes:
    """The file with references to other records: to wrong ones, to none, in circles."""
    for _ in range(int(rng.integers(1, 5))):
        match, other = _pick(_REFERENCE, content, rng), _pick(_REFERENCE, content, rng)
        if match and other:
            value = other[0] if rng.random() < 0.8 else b"#999999999"
            content = content[: match.start()] + value + content[match.end() :]
    return content


def change_records(content: bytes, rng: Random) -> bytes:
    """The file with a record twice, without one, or with the name of another entity."""
    match = _pick(_RECORD, content, rng)
    if match is None:
        return flip(content, rng)
    match int(rng.integers(3)):
        case 0:
            return content[: match.start()] + content[match.end() :]
        case 1:
            return content[: match.start()] + match[0] + content[match.start() :]
    word, other = _pick(_KEYWORD, content, rng), _pick(_KEYWORD, content, rng)
    if not word or not other:
        return cut(content, rng)
    return content[: word.start()] + other[0] + content[word.end() :]


def repeat(content: bytes, rng: Random) -> bytes:
    """The file with a piece of it many times, such as an item of a list."""
    start = int(rng.integers(len(content)))
    piece = content[start : start + int(rng.integers(1, 60))]
    return content[:start] + piece * int(rng.integers(2, 300)) + content[start:]


DAMAGES: tuple[Callable[[bytes, Random], bytes], ...] = (
    cut, flip, change_number, change_number, change_reference, change_records, repeat,
)  # fmt: skip


def damage(content: bytes, rng: Random) -> bytes:
    """The file with one kind of damage or with several."""
    for _ in range(int(rng.integers(1, 4))):
        content = DAMAGES[int(rng.integers(len(DAMAGES)))](content, rng) or b" "
    return content


def write_step(*records: str, schema: str = "AUTOMOTIVE_DESIGN") -> bytes:
    """A STEP file of these records."""
    return (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
        f"FILE_SCHEMA(('{schema}'));\nENDSEC;\nDATA;\n"
        + "\n".join(records)
        + "\nENDSEC;\nEND-ISO-10303-21;\n"
    ).encode()


_CONTEXT = (
    "#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));",
    "#2=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#1))"
    "REPRESENTATION_CONTEXT('',''));",
    "#3=CARTESIAN_POINT('',(0.,0.,0.));",
    "#4=AXIS2_PLACEMENT_3D('',#3,$,$);",
)


def _write_face(surface: str, *more: str) -> bytes:
    """A file with one face on this surface, without bounds."""
    return write_step(
        *_CONTEXT,
        f"#10={surface};",
        "#11=ADVANCED_FACE('',(#14),#10,.T.);",
        "#12=OPEN_SHELL('',(#11));",
        "#13=SHELL_BASED_SURFACE_MODEL('',(#12));",
        "#14=FACE_BOUND('',#15,.T.);",
        "#15=VERTEX_LOOP('',#16);",
        "#16=VERTEX_POINT('',#3);",
        "#17=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#13),#2);",
        *more,
    )


def build_hostile() -> Iterator[tuple[str, bytes]]:
    """Names and contents of hostile files; each is small, or much larger when it is read."""
    yield "empty", b" "
    yield "only a head", b"ISO-10303-21;"
    yield "deep brackets", write_step(*_CONTEXT, "#9=X(" + "(" * 500_000 + ")" * 500_000 + ");")
    yield "deep types", write_step(*_CONTEXT, "#9=X(" + "A(" * 200_000 + ")" * 200_000 + ");")
    yield "open string", write_step(*_CONTEXT, "#9=X('" + "a" * 1_000_000)
    yield "open comment", write_step(*_CONTEXT, "/*" + "#8=X();" * 100_000)
    yield "many comments", write_step(*_CONTEXT, "/**/" * 500_000)
    yield "many quotes", write_step(*_CONTEXT, "#9=X(" + "''" * 500_000 + ");")
    yield "many numbers", write_step(*_CONTEXT, "#9=X((" + "1.," * 500_000 + "1.));")
    yield "long number", write_step(*_CONTEXT, "#9=CARTESIAN_POINT('',(" + "9" * 1_000_000 + ".));")
    yield "long reference", write_step(*_CONTEXT, "#" + "9" * 100_000 + "=X();")
    yield "same record", write_step(*_CONTEXT, "#9=X();" * 200_000)
    points = ",".join(["#3"] * 1000)
    rows = ",".join([f"({points})"] * 1000)
    yield (
        "a million points",
        _write_face(
            f"B_SPLINE_SURFACE_WITH_KNOTS('',3,3,({rows}),.UNSPECIFIED.,.F.,.F.,.F.,(4,996,4),"
            "(4,996,4),(0.,1.,2.),(0.,1.,2.),.UNSPECIFIED.)"
        ),
    )
    yield (
        "huge multiplicity",
        _write_face(
            "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#3,#3),(#3,#3)),.UNSPECIFIED.,.F.,.F.,.F.,"
            "(2000000000,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)"
        ),
    )
    yield (
        "huge degree",
        _write_face("B_SPLINE_SURFACE('',2000000000,1,((#3,#3),(#3,#3)),.U.,.F.,.F.,.F.)"),
    )
    yield "sphere of 1e308", _write_face("SPHERICAL_SURFACE('',#4,1.E308)")
    yield "sphere of nothing", _write_face("SPHERICAL_SURFACE('',#4,0.)")
    yield "cone of a right angle", _write_face("CONICAL_SURFACE('',#4,1.,1.5707963267948966)")
    yield "offset of itself", _write_face("OFFSET_SURFACE('',#10,1.,.F.)")
    yield "trimmed itself", _write_face("RECTANGULAR_TRIMMED_SURFACE('',#10,0.,1.,0.,1.,.T.,.T.)")
    yield (
        "offsets of offsets",
        _write_face(
            "OFFSET_SURFACE('',#100,1.,.F.)",
            *(f"#{n}=OFFSET_SURFACE('',#{n + 1},1.,.F.);" for n in range(100, 5000)),
            "#5000=SPHERICAL_SURFACE('',#4,5.);",
        ),
    )
    yield (
        "curve of curves",
        _write_face(
            "SURFACE_OF_LINEAR_EXTRUSION('',#100,#90)",
            "#90=VECTOR('',#91,1.);",
            "#91=DIRECTION('',(0.,0.,1.));",
            *(
                f"#{n}=COMPOSITE_CURVE('',({','.join([f'#{n + 5000}'] * 2)}),.F.);"
                f"#{n + 5000}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{n + 1});"
                for n in range(100, 140)
            ),
            "#140=LINE('',#3,#90);",
        ),
    )
    face = "SPHERICAL_SURFACE('',#4,5.)"
    body = _write_face(face)
    yield "a face 500,000 times", body.replace(b"(#11)", b"(" + b"#11," * 500_000 + b"#11)")
    yield "a shell 200,000 times", body.replace(b"(#12)", b"(" + b"#12," * 200_000 + b"#12)")
    yield "a body 200,000 times", body.replace(b"(#13)", b"(" + b"#13," * 200_000 + b"#13)")
    yield (
        "mapped in a circle",
        _write_face(
            face,
            "#20=REPRESENTATION_MAP(#4,#22);",
            "#21=MAPPED_ITEM('',#20,#4);",
            "#22=SHAPE_REPRESENTATION('',(#21),#2);",
        ),
    )
    yield (
        "2^40 mapped items",
        _write_face(
            face,
            "#20=REPRESENTATION_MAP(#4,#17);",
            *(
                f"#{n}=MAPPED_ITEM('',#{n - 1},#4);"
                f"#{n + 1}=SHAPE_REPRESENTATION('',(#{n},#{n}),#2);"
                f"#{n + 2}=REPRESENTATION_MAP(#4,#{n + 1});"
                for n in range(21, 21 + 3 * 40, 3)
            ),
        ),
    )
    yield "2^40 instances", _write_tree(40, 2)
    yield "an instance in itself", _write_tree(1, 1).replace(b"#1002,#1001", b"#1001,#1001")
    yield "depth of 3,000", _write_tree(3000, 1)
    yield (
        "many colours",
        _write_face(
            face,
            *(f"#{n}=STYLED_ITEM('',(#{n + 1}),#11);" for n in range(100, 5100)),
            "#5100=PRESENTATION_STYLE_ASSIGNMENT((#100));",
        ),
    )
    yield (
        "unit of a unit",
        body.replace(
            b"#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));",
            b"#1=(CONVERSION_BASED_UNIT('x',#5)LENGTH_UNIT()NAMED_UNIT(*));"
            b"#5=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.),#1);",
        ),
    )
    yield (
        "a unit of zero",
        body.replace(
            b"#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));",
            b"#1=(CONVERSION_BASED_UNIT('x',#5)LENGTH_UNIT()NAMED_UNIT(*));"
            b"#5=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.),#6);"
            b"#6=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));",
        ),
    )


def _write_tree(levels: int, width: int) -> bytes:
    """An assembly of this many levels, each with `width` instances of the next."""
    records = [*_CONTEXT]
    for level in range(levels + 1):
        product = 1001 + level
        records += [
            f"#{product}=PRODUCT_DEFINITION('','',#{20000 + product},$);",
            f"#{20000 + product}=PRODUCT_DEFINITION_FORMATION('','',#{40000 + product});",
            f"#{40000 + product}=PRODUCT('p','p','',());",
        ]
        if level < levels:
            for copy in range(width):
                number = 60000 + 10 * product + copy
                records.append(
                    f"#{number}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#{product},"
                    f"#{product + 1},$);"
                )
    last = 1001 + levels
    records += [
        f"#10=PRODUCT_DEFINITION_SHAPE('','',#{last});",
        "#11=SHAPE_DEFINITION_REPRESENTATION(#10,#17);",
        "#12=SPHERICAL_SURFACE('',#4,5.);",
        "#13=ADVANCED_FACE('',(#19),#12,.T.);",
        "#14=CLOSED_SHELL('',(#13));",
        "#15=MANIFOLD_SOLID_BREP('',#14);",
        "#17=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#15),#2);",
        "#18=VERTEX_LOOP('',#16);",
        "#19=FACE_BOUND('',#18,.T.);",
        "#16=VERTEX_POINT('',#3);",
    ]
    return write_step(*records)
