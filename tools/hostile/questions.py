"""Hostile questions to breps, and to groups with breps, each with the error that it must get."""

from collections.abc import Iterator, Mapping
from itertools import pairwise

from tools.hostile.requests import (
    NOT_TO_REPEAT,
    HostileBody,
    build_case,
    build_long_case,
    repeat_word,
    vary_body,
)

SQUARE = '{"control_net":[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]]]}'
WHOLE = f'{{"surface":{SQUARE}}}'
"""A face that is a whole square."""

TWISTED = '{"control_net":[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,1]]]}'
"""A surface that ends at the sides of its net; a plane does not."""

TUBE = '{"type":"tube","curve":{"control_points":[[0,0,0],[1,0,0],[2,3,0]]},"radius":1}'


def write_polygon(*corners: str, surface: str = SQUARE) -> str:
    """A face with one loop, a polygon of parameter curves with these corners."""
    sides = (f'{{"control_points":[{a},{b}]}}' for a, b in pairwise((*corners, corners[0])))
    return f'{{"surface":{surface},"loops":[{{"pcurves":[{",".join(sides)}]}}]}}'


WRONG_FACES: Mapping[str, tuple[str, str]] = {
    "loop_reversed": (write_polygon("[0,0]", "[0,1]", "[1,1]", "[1,0]"), "/loops/0"),
    "loops_cross": (write_polygon("[0,0]", "[1,0]", "[0,1]", "[1,1]"), "/loops/0"),
    "pcurve_outside": (
        write_polygon("[0,0]", "[9,0]", "[0,1]", surface=TWISTED),
        "/loops/0/pcurves/0",
    ),
}
"""Faces that only preparing shows to be invalid, by the code of the error, with its pointer."""


def write_brep(*faces: str, fields: str = "") -> str:
    """A brep of these faces."""
    return f'{{"type":"brep","faces":[{",".join(faces)}]{fields}}}'


def write_group(*surfaces: str) -> str:
    """A group of these surfaces."""
    members = ",".join(f'{{"surface":{surface}}}' for surface in surfaces)
    return f'{{"type":"group","members":[{members}]}}'


def build_questions(name: str, fields: str) -> Iterator[HostileBody]:
    """A question with valid `fields`, to breps with invalid faces and to groups that have some."""

    def ask(surface: str) -> str:
        return f'{{"surface":{surface},{fields}}}'

    for code, (face, pointer) in WRONG_FACES.items():
        brep, where = write_brep(WHOLE, face), f"/surface/faces/1{pointer}"
        yield build_case(f"{name}: {code}", ask(brep), code, where)
        group, where = write_group(SQUARE, brep), f"/surface/members/1{where}"
        yield build_case(f"{name} to a group: {code}", ask(group), code, where)
        copies = (
            f'{{"type":"group","definitions":[{SQUARE},{brep}],"members":['
            '{"definition":0},{"definition":1},{"definition":1,"parent":0}]}'
        )
        where = f"/surface/definitions/1/faces/1{pointer}"
        yield build_case(f"{name} to copies: {code}", ask(copies), code, where)
    brep = write_brep(WHOLE)
    mixed = write_group(brep, TUBE)
    where = "/surface/members/1/surface"
    yield build_case(f"{name}: a tube beside", ask(mixed), "not_parametric", where)
    faults = {
        "unknown_face": '"shells":[{"faces":[1]}]@/shells/0/faces/0',
        "missing_field": '"edges":[{}]@/edges/0/vertices',
        "unknown_field": f'"{NOT_TO_REPEAT}":1@/{NOT_TO_REPEAT}',
    }
    body = ask(f"{brep[:-1]},?}}")
    yield from vary_body(f"{name} to a brep", body, "/surface", faults)


def build_empty_questions(name: str, fields: str) -> Iterator[HostileBody]:
    """A question to breps of which all faces are left out."""
    (face, _), skip = WRONG_FACES["loop_reversed"], ',"invalid_faces":"skip"'
    brep = write_brep(face, face, fields=skip)
    for kind, surface in (("brep", brep), ("group", write_group(brep, brep))):
        body = f'{{"surface":{surface},{fields}}}'
        yield build_case(f"{name} to a {kind} without faces", body, "no_faces", "/surface")


def build_face_points() -> Iterator[HostileBody]:
    """Requests for points of faces of a brep, or of a group."""
    faults = {
        "missing_field": '"uv":[[0,0]]@/patch "derivatives":1@/uv',
        "index_out_of_range": '"uv":[[0,0]],"patch":2@/patch "uv":[[0,0]],"patch":-1@/patch'
        ' "uv":[[0,0],[1,1]],"patch":[0,2]@/patch/1',
        "wrong_length": '"uv":[[0,0]],"patch":[0,1]@/patch',
        "outside_domain": '"uv":[[0,0],[0.5,2]],"patch":[0,1]@/uv/1/1',
        "wrong_parameters": '"barycentric":[[1,0,0]],"patch":0@/barycentric/0',
    }
    surfaces = {
        "face": write_brep(WHOLE, WHOLE),
        "group": write_group(write_brep(WHOLE), SQUARE),
    }
    for name, surface in surfaces.items():
        yield from vary_body(f"point of a {name}", f'{{"surface":{surface},?}}', "", faults)
    yield from build_questions("points", '"uv":[[0.5,0.5]],"patch":1')


def build_many_copies() -> Iterator[HostileBody]:
    """A question to more placed patches of faces than the service allows."""
    brep = write_brep(*[WHOLE] * 16)

    def write_copies() -> str:
        members = repeat_word('{"definition":0}', 65_000)
        group = f'{{"type":"group","definitions":[{brep}],"members":{members}}}'
        return f'{{"surface":{group},"points":[[0,0,1]]}}'

    yield build_long_case("copies", write_copies, "too_many_patches", "/surface")
