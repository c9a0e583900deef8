"""Writes STEP files of any length: spline faces with borders of splines, in parts of equal size."""

import math
from collections.abc import Iterator

SIZE, DEGREE = 12, 3
"""Control points of a face in each direction, and its degree in both."""

PART_FACES = 40
"""Faces of a part."""

_HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('sheets'),'2;1');
FILE_NAME('sheets','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('automotive design');
#2=PRODUCT_CONTEXT('',#1,'mechanical');
#3=PRODUCT('sheets','sheets','',(#2));
#4=PRODUCT_DEFINITION_FORMATION('','',#3);
#5=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#6=PRODUCT_DEFINITION('design','',#4,#5);
#7=PRODUCT_DEFINITION_SHAPE('','',#6);
#8=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#9=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#10=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#11=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#8,#9,#10))REPRESENTATION_CONTEXT('',''));
"""

_KNOTS = f"({DEGREE + 1},{'1,' * (SIZE - DEGREE - 1)}{DEGREE + 1})"
_VALUES = f"({','.join(f'{number}.' for number in range(SIZE - DEGREE + 1))})"


def write_sheets(length: int, seed: int = 0) -> bytes:
    """A file of about this many bytes; another seed gives other faces."""
    lines, size, number = [_HEAD], len(_HEAD), 12
    faces, models = list[int](), list[int]()
    while size < length or len(faces) % PART_FACES:
        for line in _write_sheet(number, len(faces) + 1000 * seed):
            lines.append(line)
            size += len(line)
            number += 1
        faces.append(number - 1)
        if len(faces) % PART_FACES == 0:
            lines.append(f"#{number}=OPEN_SHELL('',({_references(faces[-PART_FACES:])}));\n")
            lines.append(f"#{number + 1}=SHELL_BASED_SURFACE_MODEL('',(#{number}));\n")
            models.append(number + 1)
            number += 2
    lines += [
        f"#{number}=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',({_references(models)}),#11);\n",
        f"#{number + 1}=SHAPE_DEFINITION_REPRESENTATION(#7,#{number});\n",
        "ENDSEC;\nEND-ISO-10303-21;\n",
    ]
    return "".join(lines).encode("ascii")


def _write_sheet(first: int, sheet: int) -> Iterator[str]:
    """The entities of one face, numbered from `first`; the last is the face."""
    number = first

    def write(text: str) -> str:
        nonlocal number
        number += 1
        return f"#{number - 1}={text};\n"

    left, top = 12.0 * (sheet % 50), 12.0 * (sheet // 50)
    net = [[first + SIZE * i + j for j in range(SIZE)] for i in range(SIZE)]
    for i in range(SIZE):
        for j in range(SIZE):
            height = math.sin(0.7 * i + sheet) * math.cos(0.9 * j - sheet)
            yield write(f"CARTESIAN_POINT('',({left + i!r},{top + j!r},{height!r}))")
    rows = ",".join(f"({_references(row)})" for row in net)
    form = ".UNSPECIFIED.,.F.,.F.,.F."
    yield write(
        f"B_SPLINE_SURFACE_WITH_KNOTS('',{DEGREE},{DEGREE},({rows}),{form},"
        f"{_KNOTS},{_KNOTS},{_VALUES},{_VALUES},.UNSPECIFIED.)"
    )
    surface = number - 1
    corners = (net[0][0], net[-1][0], net[-1][-1], net[0][-1])
    for corner in corners:
        yield write(f"VERTEX_POINT('',#{corner})")
    vertices = [number - 4, number - 3, number - 2, number - 1]
    borders = ([row[0] for row in net], net[-1], [row[-1] for row in net][::-1], net[0][::-1])
    coedges = []
    for side, border in enumerate(borders):
        yield write(
            f"B_SPLINE_CURVE_WITH_KNOTS('',{DEGREE},({_references(border)}),.UNSPECIFIED.,.F.,.F.,"
            f"{_KNOTS},{_VALUES},.UNSPECIFIED.)"
        )
        ends = f"#{vertices[side]},#{vertices[(side + 1) % 4]}"
        yield write(f"EDGE_CURVE('',{ends},#{number - 1},.T.)")
        yield write(f"ORIENTED_EDGE('',*,*,#{number - 1},.T.)")
        coedges.append(number - 1)
    yield write(f"EDGE_LOOP('',({_references(coedges)}))")
    yield write(f"FACE_OUTER_BOUND('',#{number - 1},.T.)")
    yield write(f"ADVANCED_FACE('',(#{number - 1}),#{surface},.T.)")


def _references(numbers: list[int]) -> str:
    return ",".join(f"#{number}" for number in numbers)
