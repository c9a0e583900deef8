"""Hostile bodies of all calls, each with the error that it must get.

The bodies for /v1/mesh are those of `tools.hostile.requests`.
"""

import struct
from collections.abc import Iterator, Mapping

from tools.hostile.breps import BREPS, build_brep_conversions
from tools.hostile.questions import (
    build_empty_questions,
    build_face_points,
    build_many_copies,
    build_questions,
)
from tools.hostile.requests import (
    HOSTILE,
    MIB,
    NOT_NUMBERS,
    NOT_TO_REPEAT,
    SURFACE,
    VERTICES,
    HostileBody,
    build_case,
    build_document_cases,
    build_long_case,
    repeat_word,
    vary_body,
    write_many_keys,
    write_net,
    write_options,
)


def build_point_cases() -> Iterator[HostileBody]:
    """Requests to /v1/points with invalid parameters or fields."""

    def write_uv(text: str) -> str:
        return write_options(f'"uv":{text}')

    yield from vary_body("parameter", write_uv("[[0,0],[0,?]]"), "/uv/1/1", NOT_NUMBERS)
    faults = {
        "null_value": "null [[0,0],null]@/1",
        "empty_list": "[] [[]]@/0",
        "wrong_type": "[0.5,0.5]@/0 {}",
        "wrong_dimension": "[[0.5]]@/0 [[0,0],[0,0,0]]@/1",
        "outside_domain": "[[0,0],[0,1.00000000000001]]@/1/1 [[-1e-14,0]]@/0/0 [[1e308,0]]@/0/0",
    }
    yield from vary_body("uv", write_uv("?"), "/uv", faults)
    yield build_case("no uv", write_options('"derivatives":1'), "missing_field", "/uv")

    def write_two_patches(fields: str) -> str:
        """A request with a surface of two patches and these fields beside the surface."""
        return f'{{"surface":{{{VERTICES},"patches":[[[0,1],[2,3]],[[0,1],[2,3]]]}},{fields}}}'

    yield build_case("no patch", write_two_patches('"uv":[[0,0]]'), "missing_field", "/patch")
    faults = {
        "conflicting_options": '"uv":[[0,0]],"barycentric":[[1,0,0]]@/barycentric',
        "wrong_parameters": '"barycentric":[[1,0,0]]@/barycentric/0',
        "wrong_dimension": '"barycentric":[[1,0,0],[1,0]]@/barycentric/1',
        "null_value": '"barycentric":null@/barycentric',
        "unknown_field": '"uv":[[0,0]],"resolution":4@/resolution',
        "unexpected_patch": '"uv":[[0,0]],"patch":0@/patch',
    }
    yield from vary_body("query", write_options("?"), "", faults)
    faults = {"out_of_range": "3 -1", "wrong_type": '1.0 true "1" [1]', "null_value": "null"}
    yield from vary_body("derivatives", write_uv('[[0,0]],"derivatives":?'), "/derivatives", faults)
    faults = {
        "null_value": "null [0,null]@/1",
        "index_out_of_range": "2 -1 18446744073709551615 [0,2]@/1 [0,18446744073709551615]@/1",
        "wrong_type": '1.0 true "0" {} [0,true]@/1 [[0],0]@/0',
        "empty_list": "[]",
        "wrong_length": "[0] [0,0,0]",
    }
    body = write_two_patches('"uv":[[0,0],[1,1]],"patch":?')
    yield from vary_body("patch", body, "/patch", faults)
    yield from build_face_points()
    yield build_long_case(
        "points", lambda: write_uv(repeat_word("[0,0]", 300_001)), "too_many_points", "/uv"
    )
    yield build_long_case(
        "empty points", lambda: write_uv(repeat_word("[]", 3_000_001)), "too_many_values"
    )
    yield build_long_case(
        "numbers", lambda: write_uv(f"[{repeat_word('0', 900_001)}]"), "wrong_dimension", "/uv/0"
    )


QUERIES: tuple[HostileBody, ...] = tuple(build_point_cases())
"""Bodies for POST /v1/points."""


def build_store_cases() -> Iterator[HostileBody]:
    """Bodies to store that have no surface, or fields beside the surface."""
    yield from build_document_cases()
    yield build_case("an id", '{"surface":"saddle"}', "wrong_type", "/surface")
    yield build_case("the surface alone", SURFACE, "missing_field", "/surface")
    unknown_fields = (
        f'"id":"{"0" * 64}"@/id "name":"{NOT_TO_REPEAT}"@/name "resolution":4@/resolution'
        ' "up":"z"@/up "camera":null@/camera "engine":2@/engine "surfaces":[]@/surfaces'
        ' "links":{}@/links'
    )
    yield from vary_body("another field", write_options("?"), "", {"unknown_field": unknown_fields})
    two_surfaces = f'{{"surface":{SURFACE},"surface":{SURFACE}}}'
    yield build_case("two surfaces", two_surfaces, "repeated_key", "/surface")
    yield build_case("truncated", write_options('"x":1')[:-1], "malformed_json", "/x")
    pointer = "/surface/control_net"
    yield build_case(
        "not finite", write_net("[[[0,0,0],[0,1,NaN]]]"), "not_finite", f"{pointer}/0/1/2"
    )
    # Files of the store begin with such a header; their numbers, as bytes, follow the line feed.
    header = b'{"arrays":[],"canonical":1,"surface":{}}\n'
    yield build_case("a header of a stored file", header, "missing_field", pointer)
    body_with_number = f'{{"surface":{SURFACE}}}\n'.encode() + struct.pack("<d", 1)
    yield build_case("a number behind the document", body_with_number, "malformed_json")
    yield build_long_case("blanks", lambda: b" " * (3 << 20), "malformed_json")
    yield build_long_case(
        "very many keys",
        lambda: write_options(write_many_keys(60_000, "").removeprefix("{")),
        "too_many_strings",
    )


STORES: tuple[HostileBody, ...] = tuple(build_store_cases())
"""Bodies for POST /v1/surfaces."""


def build_conversion_cases() -> Iterator[HostileBody]:
    """Requests to /v1/convert with invalid operations."""
    start = '{"surface":{"control_net":[[[0,0,0],[0,1,1],[0,2,0]],[[1,0,1],[1,1,2],[1,2,1]]]},'

    transpose = '{"op":"transpose"}'

    def write_third_operation(operation: str) -> str:
        return f'{start}"operations":[{transpose},{transpose},{operation}]}}'

    def vary_operation(op: str, faults: Mapping[str, str]) -> Iterator[HostileBody]:
        """Cases of one operation; the texts of `faults` follow the name of the operation.

        The text `@` is empty: the operation has no fields.
        """
        yield from vary_body(
            op, write_third_operation(f'{{"op":"{op}"?}}'), "/operations/2", faults
        )

    faults = {
        "null_value": 'null {"op":null}@/op',
        "wrong_type": '1 [] {"op":1}@/op',
        "missing_field": "{}@/op",
        "unknown_operation": f'{{"op":"{NOT_TO_REPEAT}"}}@/op {{"op":"Elevate"}}@/op',
    }
    yield from vary_body("operation", write_third_operation("?"), "/operations/2", faults)
    faults = {
        "null_value": "null [3,null]@/1",
        "out_of_range": "0 65 [3,65]@/1",
        "wrong_type": '1e1 true [3,"3"]@/1',
        "wrong_length": "[] [3] [3,3,3]",
        "degree_too_low": "1 [3,1]@/1",
    }
    elevate = write_third_operation('{"op":"elevate","degree":?}')
    yield from vary_body("elevate", elevate, "/operations/2/degree", faults)
    faults = {
        "missing_field": "@/degree",
        "unknown_field": f',"degree":3,"{NOT_TO_REPEAT}":1@/{NOT_TO_REPEAT}',
    }
    yield from vary_operation("elevate", faults)
    faults = {
        "missing_field": "@",
        "null_value": ',"u":null@/u ,"at":[0.25,null,0.25]@/at/1',
        "wrong_type": ',"u":"0.5"@/u ,"u":true@/u',
        "out_of_range": ',"u":0@/u ,"v":1@/v ,"v":1e300@/v ,"at":[0.25,0.25,0.25]@/at'
        ' ,"at":[1e308,1e308,1e308]@/at',
        # `at` is only for triangles, and not beside `u`; its numbers are checked first.
        "unknown_field": ',"u":0.5,"at":[0.25,0.25,0.5] ,"at":[0.25,0.25,0.5]@/at',
        "wrong_length": ',"at":[0.25,0.75]@/at',
        "not_finite": ',"u":NaN@/u ,"u":1e999@/u',
    }
    yield from vary_operation("split", faults)
    faults = {
        "missing_field": "@",
        "wrong_type": ',"u":0.5@/u ,"u":[0,[1]]@/u/1',
        "wrong_length": ',"u":[0.5]@/u',
        "out_of_range": ',"u":[0.5,0.5]@/u ,"u":[1,0]@/u ,"u":[-1,1]@/u/0 ,"v":[0,2]@/v/1'
        ' ,"v":[0,1e308]@/v/1',
    }
    yield from vary_operation("restrict", faults)
    faults = {
        "missing_field": "@",
        "null_value": ',"u":null@/u',
        "wrong_type": ',"u":"0.5"@/u ,"v":[0.5]@/v',
        "unsupported_operation": ',"u":0.5@',  # a patch has no knots
    }
    yield from vary_operation("insert", faults)
    net = "[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]],[[2,0,0],[2,1,0]]]"
    spline = f'"type":"bspline","degree":1,"control_net":{net}'
    body = f'{{"surface":{{{spline}}},"operations":[{{"op":"insert"?}}]}}'
    faults = {
        "out_of_range": ',"u":0@/u ,"v":1@/v ,"u":1e-14@/u ,"u":-1e308@/u',
        "knot_multiplicity": ',"u":1@/u',
    }
    yield from vary_body("insert into a spline", body, "/operations/0", faults)
    faults = {
        "missing_field": "@/direction",
        "wrong_value": ',"direction":"w"@/direction',
        "null_value": ',"direction":null@/direction',
    }
    yield from vary_operation("reverse", faults)
    faults = {"missing_field": "@/half", "wrong_value": ',"half":"left"@/half'}
    yield from vary_operation("triangle", faults)
    faults = {
        "unknown_field": ',"u":1@/u',
        "unexpected_patch": ',"patch":0@/patch',
        "wrong_type": ',"patch":"0"@/patch ,"patch":[0]@/patch ,"patch":0.5@/patch',
        "out_of_range": ',"patch":-1@/patch',
        "null_value": ',"patch":null@/patch',
    }
    yield from vary_operation("transpose", faults)
    member = '{"surface":{"control_net":[[[0,0,0],[0,1,1]],[[1,0,1],[1,1,2]]]}}'
    group = f'{{"surface":{{"type":"group","members":[{member},{member}]}},"operations":[?]}}'
    faults = {
        "missing_field": '{"op":"split","u":0.5}@/patch {"op":"triangle","half":"lower"}@/patch',
        "index_out_of_range": '{"op":"transpose","patch":2}@/patch'
        ' {"op":"bezier","patch":18446744073709551615}@/patch',
        "out_of_range": '{"op":"split","u":0,"patch":1}@/u',
        "unsupported_operation": '{"op":"untrim","patch":1}@/patch',
    }
    yield from vary_body("group", group, "/operations/0", faults)
    faults = {
        "wrong_type": ',"weld_tolerance":"0"@/weld_tolerance',
        "out_of_range": ',"weld_tolerance":-1@/weld_tolerance ,"weld_tolerance":1@/weld_tolerance',
        "unknown_field": ',"patch":0@/patch',
    }
    yield from vary_operation("orient", faults)
    yield from vary_operation("bezier", {"unknown_field": ',"degree":3@/degree'})
    pointer = "/operations"
    faults = {"null_value": "null", "wrong_type": transpose, "wrong_length": "[]"}
    yield from vary_body("operations", f'{start}"operations":?}}', pointer, faults)
    faults = {
        "unknown_field": f'"operations":[{transpose}],"resolution":3@/resolution',
        "repeated_key": f'"operations":[{transpose}],"operations":[]@/operations',
    }
    yield from vary_body("conversion", f"{start}?}}", "", faults)
    nulls = '{"op":"elevate","degree":[null,null]}'
    yield build_long_case(
        "operations",
        lambda: write_third_operation(repeat_word(nulls, 10_000)[1:-1]),
        "wrong_length",
        pointer,
    )
    yield build_long_case(
        "nulls", lambda: write_third_operation("null," * 500_000 + "null"), "wrong_length", pointer
    )
    pointer = f"{pointer}/2/degree"
    yield build_long_case(
        "degrees", lambda: elevate.replace("?", repeat_word("4", 500_001)), "wrong_length", pointer
    )
    yield build_long_case(
        "open lists", lambda: write_third_operation("[" * 2 * MIB), "too_many_values"
    )


CONVERSIONS: tuple[HostileBody, ...] = (*build_conversion_cases(), *build_brep_conversions())
"""Bodies for POST /v1/convert."""


def build_curve_cases() -> Iterator[HostileBody]:
    """Requests to /v1/curve with invalid curves or options."""
    quarter = '"control_points":[[1,0],[1,1],[0,1]]'
    loop = '"type":"bspline","control_points":[[2,0,0],[0,2,1],[-2,0,0],[0,-2,1]]'
    faults = {"null_value": "null", "wrong_type": "[]", "unknown_type": '{"type":"circle"}@/type'}
    yield build_case("no curve", "{}", "missing_field", "/curve")
    yield from vary_body("curve", '{"curve":?}', "/curve", faults)
    linear = '"type":"bspline","degree":1,"control_points":[[0,0],[1,0],[1,1],[2,1]]'
    faults = {
        "unknown_field": f'{quarter},"radius":1@/radius',
        "weights_shape": f'{quarter},"weights":[1,1]@/weights',
        "weight_not_positive": f'{quarter},"weights":[1,-1,1]@/weights/1',
        "conflicting_options": f'{quarter},"homogeneous":true,"weights":[1,1,1]@/weights',
        "out_of_range": f'{loop},"degree":0@/degree',
        "wrong_value": f'{loop},"knots":"open"@/knots',
        "wrong_length": f'{loop},"knots":[0,0,0,0,1,1,1]@/knots',
        "knots_decrease": f'{loop},"knots":[0,0,0,0,1,1,1,0]@/knots/7',
        "knot_multiplicity": f'{linear},"knots":[0,0,1,1,2,2]@/knots/3',
    }
    yield from vary_body("field", '{"curve":{?}}', "/curve", faults)
    faults = {
        "too_few_points": "[[0,0]]",
        "degenerate_curve": "[[1,2],[1,2]]",
        "ragged": "[[0,0],[1,1,1]]@/1",
        "wrong_dimension": "[[0],[1]] [[0,0,0,1],[1,1,1,1]]",
        "wrong_type": '[[0,0],[1,"1"]]@/1/1',
        "coordinate_too_large": "[[0,0],[1,1e39]]@/1/1",
        "degree_too_high": f"[{','.join(f'[{k},0]' for k in range(66))}]",
    }
    pointer = "/curve/control_points"
    yield from vary_body("points", '{"curve":{"control_points":?}}', pointer, faults)
    faults = {
        "out_of_range": '"resolution":0@resolution "tolerance":0@tolerance'
        ' "derivatives":4@derivatives "derivatives":-1@derivatives',
        "wrong_type": '"resolution":[4,4]@resolution "tangents":1@tangents'
        ' "parameters":0.5@parameters "parameters":[[0]]@parameters/0'
        ' "derivatives":1.0@derivatives',
        "empty_list": '"parameters":[]@parameters',
        "null_value": '"parameters":null@parameters "parameters":[0,null]@parameters/1',
        "outside_domain": '"parameters":[0,1.00000000000001]@parameters/1'
        ' "parameters":[-1e-14]@parameters/0 "parameters":[1,1e308]@parameters/1',
        "tolerance_too_small": '"tolerance":1e-300@tolerance',
        "conflicting_options": '"resolution":4,"tolerance":0.1@tolerance'
        ' "parameters":[0],"resolution":4@parameters "parameters":[0],"tolerance":1@parameters',
    }
    yield from vary_body("option", f'{{"curve":{{{quarter}}},?}}', "/", faults)
    many = '{"curve":{"control_points":[[0,0],[1,1]]},"parameters":'
    yield build_long_case(
        "parameters",
        lambda: f"{many}{repeat_word('0', 300_001)}}}",
        "too_many_points",
        "/parameters",
    )


CURVES: tuple[HostileBody, ...] = tuple(build_curve_cases())
"""Bodies for POST /v1/curve."""


def build_projection_cases() -> Iterator[HostileBody]:
    """Requests to /v1/project with invalid points or tolerances."""

    def write_points(text: str) -> str:
        return write_options(f'"points":{text}')

    yield from vary_body(
        "coordinate", write_points("[[0,0,0],[0,?,0]]"), "/points/1/1", NOT_NUMBERS
    )
    faults = {
        "null_value": "null [[0,0,0],null]@/1",
        "empty_list": "[] [[]]@/0",
        "wrong_type": "[0,0,1]@/0 {}",
        "wrong_dimension": "[[0,0]]@/0 [[0,0,0,0]]@/0",
        "ragged": "[[0,0,0],[0,0]]@/1",
        "coordinate_too_large": "[[0,0,1e300]]@/0/2",
    }
    yield from vary_body("points", write_points("?"), "/points", faults)
    faults = {"out_of_range": "0 1 -1", "wrong_type": 'true "1" [1]', "null_value": "null"}
    tolerance = write_points('[[0,0,0]],"relative_tolerance":?')
    yield from vary_body("tolerance", tolerance, "/relative_tolerance", faults)
    yield from build_questions("points", '"points":[[0,0,1]]')
    yield from build_empty_questions("points", '"points":[[0,0,1]],"sign":true')
    yield from build_many_copies()
    yield build_long_case(
        "points",
        lambda: write_points(repeat_word("[0,0,0]", 200_001)),
        "too_many_points",
        "/points",
    )


def build_ray_cases() -> Iterator[HostileBody]:
    """Requests to /v1/intersect with invalid rays."""

    def write_rays(text: str) -> str:
        return write_options(f'"rays":{{{text}}}')

    origins = write_rays('"origins":?,"directions":[[0,0,1]]')
    directions = write_rays('"origins":[[0,0,1]],"directions":?')
    coordinate = origins.replace("?", "[[0,0,0],[0,?,0]]")
    yield from vary_body("coordinate", coordinate, "/rays/origins/1/1", NOT_NUMBERS)
    faults = {
        "null_value": "null [[0,0,0],null]@/1",
        "empty_list": "[]",
        "wrong_type": "[0,0,1]@/0 {}",
        "wrong_dimension": "[[0,0]]@/0",
        "coordinate_too_large": "[[0,0,1e300]]@/0/2",
    }
    yield from vary_body("origins", origins, "/rays/origins", faults)
    faults = {"zero_direction": "[[0,0,0]]@/0 [[1,0,0],[0,0,1e-200]]@/1"}
    yield from vary_body("directions", directions, "/rays/directions", faults)
    counts = '"origins":[[0,0,1],[0,0,1],[0,0,1]],"directions":[[1,0,0],[0,1,0]]'
    yield from vary_body(
        "counts", write_rays("?"), "/rays/directions", {"conflicting_options": counts}
    )
    faults = {"out_of_range": "0 1 -1", "wrong_type": 'true "1"', "null_value": "null"}
    thickness = write_options(
        '"rays":{"origins":[[0,0,1]],"directions":[[1,0,0]]},"relative_thickness":?'
    )
    yield from vary_body("thickness", thickness, "/relative_thickness", faults)
    valid = '"rays":{"origins":[[0,0,1]],"directions":[[0,0,-1]]}'
    yield from build_questions("rays", valid)
    yield from build_empty_questions("rays", valid)
    yield build_long_case(
        "rays",
        lambda: origins.replace("?", repeat_word("[0,0,0]", 200_001)),
        "too_many_rays",
        "/rays",
    )


def build_plane_cases() -> Iterator[HostileBody]:
    """Requests to /v1/intersect with invalid planes."""
    normals = write_options('"planes":{"normals":?,"offsets":[0]}')
    offsets = write_options('"planes":{"normals":[[0,0,1]],"offsets":?}')
    points = write_options('"planes":{"normals":[[0,0,1]],"points":?}')
    vectors = {
        "null_value": "null [[0,0,0],null]@/1",
        "empty_list": "[]",
        "wrong_type": "[0,0,1]@/0 {}",
        "wrong_dimension": "[[0,0]]@/0",
        "coordinate_too_large": "[[0,0,1e300]]@/0/2",
    }
    yield from vary_body("normals", normals, "/planes/normals", vectors)
    faults = {"zero_direction": "[[0,0,0]]@/0 [[1,0,0],[0,0,1e-200]]@/1"}
    yield from vary_body("lengths", normals, "/planes/normals", faults)
    yield from vary_body("points", points, "/planes/points", vectors)
    yield from vary_body("offset", offsets.replace("?", "[0,?]"), "/planes/offsets/1", NOT_NUMBERS)
    faults = {"empty_list": "[]", "wrong_type": "0 {}", "coordinate_too_large": "[0,1e300]@/1"}
    yield from vary_body("offsets", offsets, "/planes/offsets", faults)
    two_and_three = '{"normals":[[0,0,1],[0,1,0]],"offsets":[0,1,2]}'
    counts = {"conflicting_options": two_and_three}
    yield from vary_body("counts", write_options('"planes":?'), "/planes/normals", counts)
    faults = {"out_of_range": "0 -1", "wrong_type": 'true "1"', "null_value": "null"}
    tolerance = write_options('"planes":{"normals":[[0,0,1]],"offsets":[0]},"tolerance":?')
    yield from vary_body("tolerance", tolerance, "/tolerance", faults)
    valid = '"planes":{"normals":[[0,0,1]],"offsets":[0]}'
    yield from build_questions("planes", valid)
    yield from build_empty_questions("planes", valid)
    yield build_long_case(
        "planes",
        lambda: offsets.replace("?", repeat_word("0", 100_000)),
        "too_many_planes",
        "/planes",
    )


def build_measure_cases() -> Iterator[HostileBody]:
    """Requests to /v1/measure with invalid tolerances, and to measure invalid breps."""
    for name in ("tolerance", "weld_tolerance"):
        faults = {"out_of_range": "1 -1", "wrong_type": 'true "1" [1]', "null_value": "null"}
        yield from vary_body(name, write_options(f'"{name}":?'), f"/{name}", faults)
        yield build_case(f"{name} NaN", write_options(f'"{name}":NaN'), "not_finite", f"/{name}")
    yield build_case("no surface", "{}", "missing_field", "/surface")
    yield build_case("a field", write_options('"points":[[0,0,0]]'), "unknown_field", "/points")
    yield from build_questions("measure", '"tolerance":0.01')


MEASURES: tuple[HostileBody, ...] = tuple(build_measure_cases())
"""Bodies for POST /v1/measure."""


def build_check_cases() -> Iterator[HostileBody]:
    """Requests to /v1/check with invalid meshes, files of meshes, and options."""
    square = '"vertices":[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]'

    def write_mesh(fields: str) -> str:
        return write_options(f'"mesh":{{{fields}}}')

    def write_check(fields: str) -> str:
        return write_options(f'"mesh":{{{square},"faces":[[0,1,2,3]]}},{fields}')

    yield build_case("no mesh", write_options('"distances":true'), "missing_field", "/mesh")
    yield build_case("nothing", "{}", "missing_field", "/surface")
    faults = {"wrong_type": '[] "a" 1 true', "null_value": "null"}
    yield from vary_body("no object", write_options('"mesh":?'), "/mesh", faults)
    yield from vary_body(
        "coordinate",
        write_mesh('"vertices":[[0,0,0],[1,0,?],[1,1,0]],"faces":[[0,1,2]]'),
        "/mesh/vertices/1/2",
        NOT_NUMBERS,
    )
    faults = {
        "missing_field": f"{square}@/faces",
        "empty_list": f'"faces":[],{square}@/faces "vertices":[],"faces":[[0,1,2]]@/vertices',
        "index_out_of_range": f'"faces":[[0,1,4]],{square}@/faces/0/2 '
        f'"faces":[[0,1,-1]],{square}@/faces/0/2',
        "wrong_dimension": f'"faces":[[0,1]],{square}@/faces/0 '
        f'"faces":[[0,1,2,3,0]],{square}@/faces/0',
        "wrong_type": f'"faces":[[0,1,2.0]],{square}@/faces/0/2 "faces":{{}},{square}@/faces',
        "wrong_length": f'"normals":[[0,0,1]],"faces":[[0,1,2]],{square}@/normals',
        "coordinate_too_large": '"vertices":[[0,0,0],[1,0,1e39],[1,1,0]],'
        '"faces":[[0,1,2]]@/vertices/1/2',
        "unknown_field": f'"{NOT_TO_REPEAT}":1,{square},"faces":[[0,1,2]]@/{NOT_TO_REPEAT} '
        f'"file":"T0ZG",{square},"faces":[[0,1,2]]@/file',
    }
    yield from vary_body("mesh", write_mesh("?"), "/mesh", faults)
    faults = {
        "wrong_value": '"file":"T0Z","format":"off"@/file "file":"T0ZG","format":"exe"@/format '
        '"file":"\u00e9","format":"off"@/file',
        "wrong_type": '"file":1,"format":"off"@/file',
        "missing_field": '"file":"T0ZG"@/format',
        "null_value": '"file":null,"format":"off"@/file',
    }
    yield from vary_body("file", write_mesh("?"), "/mesh", faults)
    limits = {"out_of_range": "0 1 -1", "wrong_type": 'true "1" [1]', "null_value": "null"}
    for name, faults in {
        "relative_tolerance": limits,
        "quad_diagonal": {"wrong_value": '"20" "0" 2 true', "null_value": "null"},
        "distances": {"wrong_type": '1 "yes"', "null_value": "null"},
    }.items():
        yield from vary_body(name, write_check(f'"{name}":?'), f"/{name}", faults)
    yield build_case("an id", '{"surface":"saddle"}', "wrong_type", "/surface")
    mesh = f'"mesh":{{{square},"faces":[[0,1,2,3]]}}'
    point = '{"control_net":[[[0,0,0],[0,0,0]],[[0,0,0],[0,0,0]]]}'
    yield build_case("a point", f'{{"surface":{point},{mesh}}}', "no_faces", "/surface")
    yield from build_empty_questions("check", mesh)
    for case in build_questions("check", mesh):
        if case.code != "not_parametric":  # tubes have meshes
            yield case


def build_picture_cases() -> Iterator[HostileBody]:
    """Requests to /v1/image with invalid options."""
    limits = {
        "width": "0 2049",
        "height": "-1 1e9",
        "azimuth": "361",
        "elevation": "91 -91",
        "zoom": "0 1001",
        "field_of_view": "0 4 -1",
    }
    for name, values in limits.items():
        faults = {"out_of_range": values, "wrong_type": 'true "1" [1]', "null_value": "null"}
        if name in ("width", "height"):
            faults["out_of_range"] = values.replace("1e9", "99999")
        yield from vary_body(name, write_options(f'"{name}":?'), f"/{name}", faults)
        yield build_case(f"{name} NaN", write_options(f'"{name}":NaN'), "not_finite", f"/{name}")
    for name in ("position", "target"):
        faults = {"wrong_type": '1 "x" [true,1,2]@/0', "null_value": "null"}
        yield from vary_body(name, write_options(f'"{name}":?'), f"/{name}", faults)
    for name in ("look", "background"):
        yield build_case(name, write_options(f'"{name}":"x"'), "wrong_value", f"/{name}")
    yield build_case("no surface", "{}", "missing_field", "/surface")


CALLS: Mapping[str, tuple[HostileBody, ...]] = {
    "/v1/image": tuple(build_picture_cases()),
    "/v1/mesh": (*HOSTILE, *BREPS),
    "/v1/points": QUERIES,
    "/v1/surfaces": STORES,
    "/v1/project": tuple(build_projection_cases()),
    "/v1/intersect": (*build_ray_cases(), *build_plane_cases()),
    "/v1/measure": MEASURES,
    "/v1/check": tuple(build_check_cases()),
    "/v1/convert": CONVERSIONS,
    "/v1/curve": CURVES,
}
"""Hostile bodies by the path of the call."""
