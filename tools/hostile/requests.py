"""Harmful and invalid bodies, each with the error that the service must return.

A case has the code and the pointer of the first error; `STATUS` has the statuses of codes. Many
bodies contain the text `NOT_TO_REPEAT`, which responses must not repeat.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

NOT_TO_REPEAT = "zq9x7"
"""A text that only bodies contain: a response that has it repeats a part of the body."""

NET = "[[[0,0,0],[0,1,1]],[[1,0,1],[1,1,2]]]"
SURFACE = f'{{"control_net":{NET}}}'
VERTICES = '"type":"patches","vertices":[[0,0,0],[0,1,0],[1,0,0],[1,1,0]]'
ONE_PATCH = '"patches":[[[0,1],[2,3]]]'
SPLINE = f'"type":"bspline","control_net":{NET}'
"""Valid JSON texts: a control net; a surface with it; and fields of surfaces: the vertices of a
surface of patches, one patch with these vertices, and a B-spline, whose degree is left out."""

MIB = 1 << 20
CHUNK = 1 << 16
"""Bytes of one chunk of a long body: a server receives it in chunks."""

STATUS = {"malformed_json": 400, "malformed_body": 400, "body_too_large": 413}
"""Statuses by code; all other codes have the status 422."""


_KNOTS = '"knotvector_u":[0,0,1,1],"knotvector_v":[0,0,1,1]'

FOREIGN_FIELDS = {
    "numbers": f'"ctrlpts":1e308,"size_u":-1,"degree_u":1e308,{_KNOTS}',
    "texts": f'"ctrlpts":["{NOT_TO_REPEAT}"],"degrees":["{NOT_TO_REPEAT}"],{_KNOTS}',
    "points beyond doubles": f'"ctrlpts":[[1e308,1e39,0],[1{"0" * 300},0,0]],"degree":1,{_KNOTS}',
    "multiplicities": '"ctrlpts":[[0,0,0]],"degree":1,"knots":[[0,1],[0,1]],'
    '"multiplicities":[[1000000000,1],[9223372036854775807,9223372036854775807]]',
    "sizes": f'"ctrlpts":[0,0,0],"size_u":4294967296,"size_v":4294967296,"degree":1,{_KNOTS}',
    "objects": '"ctrlpts":{"ctrlpts":{}},"nurbs":{"nurbs":{"ctrlpts":[]}},"order":null',
    "empty lists": '"ctrlpts":[[],[]],"knots":[],"degrees":[],"weights":[]',
}
"""Fields of other programs, which are no surface there, either."""


def split_body(body: bytes) -> list[bytes]:
    """The body in chunks of `CHUNK` bytes, as a server receives it; an empty body is one chunk."""
    return [body[start : start + CHUNK] for start in range(0, max(len(body), 1), CHUNK)]


@dataclass(frozen=True)
class HostileBody:
    """A body and its error; `build` builds the body when a test needs it, as some are long."""

    name: str
    build: Callable[[], bytes]
    code: str
    pointer: str

    @property
    def status(self) -> int:
        """The status that the response must have."""
        return STATUS.get(self.code, 422)

    def chunks(self) -> Iterator[bytes]:
        """Builds the body; yields its chunks as a server receives them."""
        yield from split_body(self.build())


def encode_body(body: str | bytes) -> bytes:
    """The bytes of a body; a text in UTF-8."""
    return body.encode() if isinstance(body, str) else body


def build_case(name: str, body: str | bytes, code: str, pointer: str = "") -> HostileBody:
    """A case with this body, and with the code and the pointer of its first error."""
    content = encode_body(body)
    return HostileBody(name, lambda: content, code, pointer)


def build_long_case(
    name: str, build: Callable[[], str | bytes], code: str, pointer: str = ""
) -> HostileBody:
    """A case whose body is long, and therefore built later, by the function `build`."""
    return HostileBody(f"long: {name}", lambda: encode_body(build()), code, pointer)


def vary_body(
    name: str, body: str, pointer: str, faults: Mapping[str, str]
) -> Iterator[HostileBody]:
    """A case for each fault: its text replaces the `?` in the body.

    `faults` maps the code of the error to texts, which are separated by blanks. The error is at
    `pointer`. If a text ends in `@` and the rest of a pointer, as in `[0,null]@/1`, the error is
    below `pointer`; the `@` and the rest are not in the body.
    """
    for code, words in faults.items():
        for word in words.split():
            text, _, end_of_pointer = word.partition("@")
            yield build_case(
                f"{name} {text[:60]} {code}",
                body.replace("?", text),
                code,
                pointer + end_of_pointer,
            )


def write_surface(fields: str) -> str:
    """The JSON text of a request with a surface of these fields."""
    return f'{{"surface":{{{fields}}}}}'


def write_net(text: str) -> str:
    """The JSON text of a request with a Bézier surface of this control net."""
    return write_surface(f'"control_net":{text}')


def write_patches(fields: str) -> str:
    """The JSON text of a request with a surface of patches; `fields` follow the vertices."""
    return write_surface(f"{VERTICES},{fields}")


def write_options(fields: str) -> str:
    """The JSON text of a request with a valid surface and these fields beside the surface."""
    return f'{{"surface":{SURFACE},{fields}}}'


NOT_NUMBERS = {
    "not_finite": f"NaN nan Infinity -Infinity 1e400 -1e400 {'9' * 400}",
    "wrong_type": f'"1.5" "{NOT_TO_REPEAT}" true false {{}} {{"{NOT_TO_REPEAT}":1}} [] [1]',
    "null_value": "null",
}
"""Texts that are invalid where a number is required, by the code of the error."""

NUMBER_BODIES = {
    "control_net/0/1/2": write_net("[[[0,0,0],[0,1,?]],[[1,0,1],[1,1,2]]]"),
    "control_net/1/1/2": write_net("[[[0,0,0],[0,1,0]],[[1,0,1],[1,1,?]]]"),
    "weights/1/0": write_surface(f'"control_net":{NET},"weights":[[1,1],[?,1]]'),
    "vertices/1/1": write_surface(
        f'"type":"patches",{ONE_PATCH},"vertices":[[0,0,0],[0,?,0],[1,0,0],[1,1,0]]'
    ),
    "weights/3": write_patches(f'{ONE_PATCH},"weights":[1,1,1,?]'),
    "patches/0/1/1": write_patches('"patches":[[[0,1],[2,?]]]'),
    "colors/0/1/1": write_surface(f'"control_net":{NET},"colors":[[[0,0,1],[0,?,1]]]'),
    "uvs/0/0/0": write_surface(f'"control_net":{NET},"uvs":[[[?,0]]]'),
    "attributes/a/1/0/0": write_surface(f'"control_net":{NET},"attributes":{{"a":[[[0]],[[?]]]}}'),
    "parts/a/0": write_patches(f'{ONE_PATCH},"parts":{{"a":[?]}}'),
}
"""Requests with a `?` in place of a number, by the pointer of the number in the surface."""


def build_number_cases() -> Iterator[HostileBody]:
    """Requests in which a value that is not a number replaces a number."""
    for pointer, body in NUMBER_BODIES.items():
        yield from vary_body(f"{pointer}:", body, f"/surface/{pointer}", NOT_NUMBERS)


def build_text_cases() -> Iterator[HostileBody]:
    """Bodies that are not JSON."""
    for name, body, pointer in (
        ("empty body", "", ""),
        ("blanks", " \n\t ", ""),
        ("two byte order marks", 2 * b"\xef\xbb\xbf" + b"{}", ""),
        ("UTF-16", write_options('"resolution":1').encode("utf-16"), ""),
        ("UTF-32", write_options('"resolution":1').encode("utf-32"), ""),
        ("Latin-1", b'{"name":"\xe9"}', ""),
        ("zero bytes", b"\0\0\0\0", ""),
        ("truncated", write_net(NET)[:-9], "/surface/control_net/1/1/0"),
        ("truncated in a string", '{"surface":{"na', "/surface/na"),
        ("two documents", "{}{}", ""),
        ("trailing comma", write_net("[[0,0,0],]"), "/surface/control_net/0"),
        ("single quotes", "{'surface':1}", ""),
        ("comment", '{"surface":/*x*/1}', "/surface"),
        ("unquoted key", "{surface:1}", ""),
        ("leading zero", write_options('"resolution":016'), "/resolution"),
        ("leading plus", write_options('"resolution":+16'), "/resolution"),
        ("hexadecimal", write_options('"resolution":0x10'), "/resolution"),
        ("bare point", write_options('"crease_angle":.5'), "/crease_angle"),
        ("undefined", write_options('"uvs":undefined'), "/uvs"),
        ("Python's True", write_options('"uvs":True'), "/uvs"),
        ("line feed in a string", write_surface('"name":"a\nb"'), "/surface/name"),
        ("lone surrogate", write_surface('"name":"\\ud800"'), "/surface/name"),
        ("half an escape", write_surface('"name":"\\u00"'), "/surface/name"),
        ("form", "surface=1&resolution=2", ""),
        ("XML", f"<surface>{NOT_TO_REPEAT}</surface>", ""),
    ):
        yield build_case(name, body, "malformed_json", pointer)
    yield build_case("deep lists", "[" * 100_000, "too_deep")
    yield build_case("deep objects", '{"a":' * 5000, "too_deep")
    yield build_case("somewhat deep lists", write_net("[" * 40 + "0" + "]" * 40), "too_deep")


def build_net_cases() -> Iterator[HostileBody]:
    """Control nets and weights of the wrong shape or value."""
    row, pointer = "[[0,0,0],[0,1,0]]", "/surface/control_net"
    faults = {
        "empty_list": "[] [[],[]]@/0 [[[],[]],[[],[]]]@/0/0",
        "wrong_type": f'1 "{NOT_TO_REPEAT}" true {{"{NOT_TO_REPEAT}":[]}} [0,0,0,1]@/0 {row}@/0/0',
        "null_value": f"null [{row},null]@/1 [{row},[[1,0,0],null]]@/1/1",
        "ragged": f"[{row},[[0,0,0]]]@/1 [[[0,0,0]],{row}]@/1",
        "wrong_dimension": "[[[[0,0,0]]]]@/0/0 [[[0],[1]],[[1],[1]]]@/0/0"
        " [[[0,0,0,1],[0,1,0,1]],[[1,0,0,1],[1,1,0,1]]]@/0/0"
        " [[[0,0,0],[0,1,0]],[[1,0,0],[1,1]]]@/1/1",
        "too_few_points": f"[[[0,0,0]]] [{row}] [[[0,0,0]],[[1,0,0]]]",
    }
    yield from vary_body("net", write_net("?"), pointer, faults)
    yield from vary_body(
        "coordinate",
        write_net(f"[{row},[[1,0,0],[1,?,0]]]"),
        f"{pointer}/1/1/1",
        {"coordinate_too_large": "3.5e38 -3.5e38 1e39 -1e308"},
    )
    yield build_case(
        "degree 65", write_net(str([[[0, 0, 0]] * 66] * 2)), "degree_too_high", pointer
    )
    yield build_case(
        "degree 999", write_net(str([[[0, 0, 0]] * 2] * 1000)), "degree_too_high", pointer
    )
    faults = {
        "null_value": "null",
        "wrong_type": "[1,1,1,1]@/0 1",
        "empty_list": "[]",
        "ragged": "[[1,1],[1]]@/1",
        "weights_shape": "[[1,1]] [[1,1,1],[1,1,1]]",
        "weight_not_positive": "[[1,1],[1,0]]@/1/1 [[1,1],[1,-0.0]]@/1/1 [[-1,1],[1,1]]@/0/0",
        "weight_ratio": "[[1e-300,1],[1,1e300]]",
    }
    weights = f'"control_net":{NET},"weights":'
    yield from vary_body("weights", write_surface(f"{weights}?"), "/surface/weights", faults)
    yield from build_homogeneous_cases()


def build_homogeneous_cases() -> Iterator[HostileBody]:
    """Homogeneous control points of another form, or with weights that do not become positive."""

    def write(row: str) -> str:
        return f'"homogeneous":true,"control_net":[[{row}],[{row}]]'

    def write_weights(*weights: float) -> str:
        return write(",".join(f"[{x},0,0,{w}]" for x, w in enumerate(weights)))

    faults = {"null_value": "null", "wrong_type": '1 "true" []'}
    body = write_surface(f'"control_net":{NET},"homogeneous":?')
    yield from vary_body("homogeneous", body, "/surface/homogeneous", faults)
    for name, text, code, pointer in (
        ("points of three numbers", write("[0,0,0],[1,0,1]"), "wrong_dimension", "control_net/0/0"),
        ("points of two numbers", write("[0,0],[1,1]"), "wrong_dimension", "control_net/0/0"),
        ("weights beside", f'{write_weights(1, 1)},"weights":[[1,1],[1,1]]',
         "conflicting_options", "weights"),
        ("all weights 0", write_weights(0, 0), "weight_not_positive", "control_net/0/0"),
        ("all weights negative", write_weights(-1, -1), "weight_not_positive", "control_net/0/0"),
        ("a corner -0", write_weights(1, 1, -0.0), "weight_not_positive", "control_net/0/2"),
        ("a corner below the others", write_weights(1, 0, 1e-300), "weight_not_positive", ""),
        ("weights that vanish", write_weights(1, -1, 1), "weight_not_positive", ""),
        ("weights that change sign", write_weights(1, -9, 1), "weight_not_positive", ""),
        ("weights that nearly vanish", write_weights(1, -0.99, 1), "degree_too_high", ""),
        ("a far corner", write_weights(1, *[0] * 40, 1), "weight_not_positive", ""),
        ("a number that is no number", write("[0,0,0,1],[NaN,0,0,1]"),
         "not_finite", "control_net/0/1/0"),
        ("a quotient that is too large", write("[0,0,0,1],[1e300,0,0,1e-5]"),
         "coordinate_too_large", "control_net/0/1/0"),
        ("a quotient beyond float64", write("[0,0,0,1],[1e305,0,0,1e-5]"),
         "not_finite", "control_net/0/1/0"),
    ):  # fmt: skip
        place = f"/surface/{pointer}" if pointer else "/surface"
        yield build_case(f"homogeneous: {name}", write_surface(text), code, place)
    # Nine control points of each member become some 2,000.
    weights = (1, -0.95, 1)
    net = [[[0, 0, 0, first * second] for second in weights] for first in weights]
    member = f'{{"surface":{{"homogeneous":true,"control_net":{net}}}}}'
    yield build_long_case(
        "homogeneous: many members of high degree",
        lambda: write_surface(f'"type":"group","members":[{",".join([member] * 600)}]'),
        "too_many_control_points",
        "/surface/members",
    )


def build_patch_cases() -> Iterator[HostileBody]:
    """Patches, vertices and parts of the wrong shape or value."""
    faults = {
        "empty_list": "[] [[]]@/0 [[[]]]@/0/0",
        "null_value": "null",
        "wrong_type": "[0,1,2,3]@/0 [[0,1],[2,3]]@/0/0 [[[0,1],[2,1.5]]]@/0/1/1"
        " [[[0,1],[2,3.0]]]@/0/1/1 [[[0,1],[2,99999999999999999999]]]@/0/1/1",
        "ragged": "[[[0,1],[2]]]@/0/1 [[[0,1],[2,3]],[[0,1],[2,3],[0]]]@/1/2",
        "too_few_points": "[[[0,1]]] [[[0],[1]]] [[[0,1],[2,3]],[[0,1]]]@/1",
        "index_out_of_range": "[[[0,1],[2,4]]]@/0/1/1 [[[0,1],[2,-1]]]@/0/1/1"
        " [[[0,1],[2,9007199254740993]]]@/0/1/1 [[[0,1],[2,18446744073709551615]]]@/0/1/1"
        " [[[0,1],[2,3]],[[0,1],[2,3],[0,4]]]@/1/2/1",
    }
    yield from vary_body("patches", write_patches('"patches":?'), "/surface/patches", faults)
    faults = {"empty_list": "[]", "wrong_type": "[0,0,0]@/0"}
    without_vertices = f'"type":"patches",{ONE_PATCH}'
    pointer = "/surface/vertices"
    yield from vary_body(
        "vertices", write_surface(f'{without_vertices},"vertices":?'), pointer, faults
    )
    yield build_case("vertices left out", write_surface(without_vertices), "missing_field", pointer)
    yield build_case(
        "patches left out", write_surface(VERTICES), "missing_field", "/surface/patches"
    )
    faults = {"weights_shape": "[1,1,1]", "weight_not_positive": "[1,1,1,0]@/3"}
    pointer = "/surface/weights"
    yield from vary_body(
        "vertex weights", write_patches(f'{ONE_PATCH},"weights":?'), pointer, faults
    )
    faults = {
        "null_value": 'null {"a":null}@/a',
        "wrong_type": '[] {"a":0}@/a {"a/b~":[true]}@/a~1b~0/0',
        "empty_list": '{"a":[]}@/a',
        "index_out_of_range": '{"a":[1]}@/a/0 {"a":[-1]}@/a/0',
        "repeated_patch": '{"a":[0,0]}@/a/1 {"a":[0],"b":[0]}@/b/0',
        # Pointers have the first 64 characters of a long key.
        "wrong_length": f'{{"":[0]}}@/ {{"{"k" * 101}":[0]}}@/{"k" * 64}…',
        "wrong_value": '{"a\\u0000":[0]}@/a\0',
    }
    yield from vary_body("parts", write_patches(f'{ONE_PATCH},"parts":?'), "/surface/parts", faults)


def build_triangle_cases() -> Iterator[HostileBody]:
    """Rows of triangles of the wrong shape or value."""
    first = "[[0,0,0],[1,0,0],[2,0,0]]"
    first_two = f"[{first},[[0,1,0],[1,1,0]]"
    faults = {
        "null_value": f"null [{first},[[0,1,0],null],[[0,2,0]]]@/1/1",
        "empty_list": f"[] {first_two},[]]@/2",
        "wrong_type": f'"{NOT_TO_REPEAT}" [{first},[[0,1,0],[1,1,true]],[[0,2,0]]]@/1/1/2',
        "too_few_points": "[[[0,0,0]]]",
        "ragged": f"[{first}]@/0 {first_two}]@/0 [{first},[[0,1,0]],[[0,2,0]]]@/1"
        f" {first_two},[[0,2,0],[0,0,0]]]@/2",
        "wrong_dimension": f"[{first},[[0,1,0],[1,1]],[[0,2,0]]]@/1/1",
        "coordinate_too_large": f"{first_two},[[0,2e38,4e38]]]@/2/0/2",
        "degree_too_high": json.dumps(
            [[[0, 0, 0]] * (66 - m) for m in range(66)], separators=(",", ":")
        )
        + f" [{'[],' * 9_999}[]]",
    }

    def write_triangle(text: str) -> str:
        return write_surface(f'"type":"triangle","control_net":{text}')

    yield from vary_body("triangle", write_triangle("?"), "/surface/control_net", faults)
    for field, faults in {
        "weights": {
            "null_value": "null",
            "wrong_type": "[1,1,1,1,1,1]@/0",
            "weights_shape": "[[1,1],[1]]",
            "ragged": "[[1,1,1],[1,1,1],[1]]@/1",
            "weight_not_positive": "[[1,1,1],[1,1],[0]]@/2/0 [[1,1,1],[1,-1],[1]]@/1/1",
        },
        "colors": {
            "out_of_range": "[[[0,0,0],[1,1,1]],[[1,0,2]]]@/1/0/2",
            "ragged": "[[[0,0,0],[1,1,1]],[[1,0,1],[1,0,0]]]@/1",
        },
        "uvs": {"wrong_dimension": "[[[0,0],[0,1]],[[1,0,1]]]@/1/0"},
        "attributes": {
            "wrong_value": '{"a~b":[[[1]]]}@/a~0b',
            "coordinate_too_large": '{"a":[[[1],[2]],[[1e39]]]}@/a/1/0/0',
        },
    }.items():
        body = write_triangle(f'{first_two},[[0,2,0]]],"{field}":?')
        yield from vary_body(f"triangle {field}", body, f"/surface/{field}", faults)
    faults = {
        "null_value": "null",
        "empty_list": "[]",
        "wrong_type": "[[0,1],[2]]@/0/0 [[[0,1],[2.0]]]@/0/1/0",
        "ragged": "[[[0,1]]]@/0/0 [[[0,1],[2]],[[0]]]@/1",
        "too_few_points": "[[[0]]]",
        "index_out_of_range": "[[[0,1],[4]]]@/0/1/0 [[[1,2],[3]],[[0,-1],[2]]]@/1/0/1",
    }
    yield from vary_body("triangles", write_patches('"triangles":?'), "/surface/triangles", faults)
    body = write_patches(f'{ONE_PATCH},"triangles":[[[0,1],[2]]],"parts":{{"a":[0,2]}}')
    yield build_case(
        "a part beyond the triangles", body, "index_out_of_range", "/surface/parts/a/1"
    )


def build_document_cases() -> Iterator[HostileBody]:
    """Documents and surfaces of a wrong type, for `HOSTILE` and for the bodies to store."""
    not_objects = f'[] 1 "{NOT_TO_REPEAT}" true {NET}'
    faults = {"wrong_type": not_objects, "null_value": "null", "missing_field": "{}@/surface"}
    yield from vary_body("document", "?", "", faults)
    faults = {
        "wrong_type": not_objects,
        "null_value": "null",
        "missing_field": "{}@/control_net",
    }
    yield from vary_body("surface", '{"surface":?}', "/surface", faults)


def build_field_cases() -> Iterator[HostileBody]:
    """Surfaces and fields of a wrong type."""
    for field, faults in {
        "type": {
            "unknown_type": f'"{NOT_TO_REPEAT}" "Bezier" ""',
            "null_value": "null",
            "wrong_type": '1 ["bezier"] {}',
        },
        "up": {"wrong_value": '"x" "Y" 2', "null_value": "null"},
        "name": {
            "wrong_length": f'"" "{"n" * 101}"',
            "wrong_value": '"a\\nb" "\\u0000" "\\u2028"',
            "null_value": "null",
            "wrong_type": "5",
        },
    }.items():
        body = write_surface(f'"{field}":?,"control_net":{NET}')
        yield from vary_body(field, body, f"/surface/{field}", faults)
    for name, body, pointer in (
        (
            "bezier with patches",
            write_surface(f'"control_net":{NET},{ONE_PATCH}'),
            "/surface/patches",
        ),
        (
            "patches with a net",
            write_patches(f'{ONE_PATCH},"control_net":{NET}'),
            "/surface/control_net",
        ),
        ("field", write_options(f'"colour":"{NOT_TO_REPEAT}"'), "/colour"),
        (
            "field of a surface",
            write_surface(f'"control_net":{NET},"knots":null'),
            "/surface/knots",
        ),
        ("format in the body", write_options('"format":"glb"'), "/format"),
        ("capital letter", write_options('"Resolution":4'), "/Resolution"),
        ("prototype", write_options('"__proto__":{}'), "/__proto__"),
        ("long key", write_options(f'"{"k" * 5000}":1'), "/" + "k" * 64 + "…"),
    ):
        yield build_case(f"unknown: {name}", body, "unknown_field", pointer)
    for name, fields in FOREIGN_FIELDS.items():
        body = write_surface(fields)
        yield build_case(f"foreign: {name}", body, "unknown_field", "/surface/ctrlpts")


def build_repeated_key_cases() -> Iterator[HostileBody]:
    """Objects with a repeated key, at every level of a document."""
    for name, body, pointer in (
        ("surface", f'{{"surface":{SURFACE},"surface":{SURFACE}}}', "/surface"),
        ("option", write_options('"uvs":true,"uvs":false'), "/uvs"),
        ("option, escaped", write_options('"uvs":true,"\\u0075vs":true'), "/uvs"),
        ("net", write_surface(f'"control_net":{NET},"control_net":{NET}'), "/surface/control_net"),
        ("part", write_patches(f'{ONE_PATCH},"parts":{{"a":[0],"a":[0]}}'), "/surface/parts/a"),
        ("key in a list", write_net('[[0],{"a":1,"a":2}]'), "/surface/control_net/1/a"),
        ("key and a colon in a name", write_surface('"name":"a:b","name":"c"'), "/surface/name"),
    ):
        yield build_case(f"twice: {name}", body, "repeated_key", pointer)


def build_spline_cases() -> Iterator[HostileBody]:
    """B-splines with invalid degrees and knots."""
    faults = {
        "null_value": 'null ["clamped",null]@/1 ["clamped",[0,0,1,null]]@/1/3',
        "wrong_type": '1 {} [0,1]@/0 ["clamped",true]@/1 ["clamped",[[0,0,1,1]]]@/1/0'
        ' ["clamped",[0,0,1,"1"]]@/1/3 ["clamped",[0,0,1,true]]@/1/3',
        "wrong_value": f'"{NOT_TO_REPEAT}" ["clamped","{NOT_TO_REPEAT}"]@/1',
        "wrong_length": '[] ["clamped"] [0,0,1,1] ["clamped",[0,0,1]]@/1'
        ' ["clamped",[0,0,1,1,1]]@/1',
        "empty_list": '["clamped",[]]@/1',
        "knots_decrease": '["clamped",[0,1,0,1]]@/1/2',
        # At 1e12, knots that differ by 0.001 count as equal (`MIN_RATIO` in `surface/knots.py`).
        "empty_domain": '["clamped",[0,1,1,2]]@/1 ["clamped",[0,1e12,1000000000000.001,2e12]]@/1',
        "knot_too_large": '["clamped",[0,0,1e-300,1e39]]@/1/3'
        ' ["clamped",[-1e308,-1e308,1e308,1e308]]@/1/0',
        "knots_too_close": '["clamped",[0,0,5e-324,5e-324]]@/1/2'
        ' ["clamped",[0,0,1e-39,1e-39]]@/1/2',
    }
    linear = f'{SPLINE},"degree":1'
    yield from vary_body("knots", write_surface(f'{linear},"knots":?'), "/surface/knots", faults)
    faults = {
        "null_value": "null [1,null]@/1",
        "out_of_range": "0 -1 [0,1]@/0",
        "degree_too_high": "65 [1,65]@/1 [1,18446744073709551615]@/1",
        "wrong_type": '99999999999999999999 1.0 true "3" {} [1,1.5]@/1',
        "wrong_length": "[] [1,1,1]",
    }
    yield from vary_body("degree", write_surface(f'{SPLINE},"degree":?'), "/surface/degree", faults)
    for fields, code, field in (
        # `NET` has 2 × 2 points: a periodic direction needs 3, and the default degree, 3, needs 4.
        (f'{linear},"knots":"periodic"', "too_few_points", "control_net"),
        (SPLINE, "too_few_points", "control_net"),
        (f'{linear},"weights":[[1,1]]', "weights_shape", "weights"),
        ('"type":"bspline"', "missing_field", "control_net"),
        (f'{linear},"vertices":[[0,0,0]]', "unknown_field", "vertices"),
    ):
        yield build_case(f"spline {fields}", write_surface(fields), code, f"/surface/{field}")


def build_group_cases() -> Iterator[HostileBody]:
    """Groups with invalid members, names, colours or placements."""
    pointer, identity = "/surface/members", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"

    def write_group(members: str) -> str:
        return write_surface(f'"type":"group","members":{members}')

    def write_member(fields: str) -> str:
        """A group whose second member has these fields."""
        return write_group(f'[{{"surface":{SURFACE}}},{{"surface":{SURFACE},{fields}}}]')

    def replace_row(numbers: str) -> str:
        """The identity matrix with another second row."""
        return identity.replace("[0,1,0,0]", numbers)

    faults = {
        "wrong_length": "[]",
        "wrong_type": '{} [1]@/0 [{"surface":{"control_net":[[["0",0,0]]]}}]'
        "@/0/surface/control_net/0/0/0",
        "null_value": 'null [null]@/0 [{"surface":null}]@/0/surface',
        "missing_field": "[{}]@/0/surface",
        "nested_group": '[{"surface":{"type":"group","members":[]}}]@/0/surface/type',
        "unknown_type": '[{"surface":{"type":"tvist"}}]@/0/surface/type',
        "wrong_value": f'[{{"surface":{{"control_net":{NET},"up":"x"}}}}]@/0/surface/up',
        "too_few_points": '[{"surface":{"control_net":[[[0,0,0]]]}}]@/0/surface/control_net',
        "unknown_field": f'[{{"surface":{SURFACE},"{NOT_TO_REPEAT}":1}}]@/0/{NOT_TO_REPEAT}',
        "repeated_key": f'[{{"surface":{SURFACE},"name":"a","name":"b"}}]@/0/name',
    }
    yield from vary_body("members", write_group("?"), pointer, faults)
    nested_groups = '{"type":"group","members":[{"surface":' * 8 + SURFACE + "}]}" * 8
    body = f'{{"surface":{nested_groups}}}'
    yield build_case("groups in groups", body, "nested_group", f"{pointer}/0/surface/type")
    yield build_case("members left out", write_surface('"type":"group"'), "missing_field", pointer)
    # At most 4096 members are allowed.
    members = ",".join([f'{{"surface":{SURFACE}}}'] * 4097)
    yield build_case("too many members", write_group(f"[{members}]"), "wrong_length", pointer)
    # Scales by 3e38 and moves by 3e38, so that the sum is larger than the largest float32, 3.4e38.
    large_matrix = "[[3e38,0,0,0],[0,3e38,0,3e38],[0,0,3e38,0],[0,0,0,1]]"
    faults = {
        "null_value": "null",
        "wrong_type": f"1 [1,0,0,0]@/0 {replace_row('[0,true,0,0]')}@/1/1",
        "empty_list": "[]",
        "wrong_dimension": "[[1,0,0],[0,1,0],[0,0,1]]",
        "ragged": f"{replace_row('[0,1,0]')}@/1",
        "out_of_range": f"{replace_row('[0,1,0,1e308]')}@/1/3",
        "not_finite": f"{replace_row('[0,1,0,NaN]')}@/1/3",
        # A zero row, scalings that differ by 1e7, parallel rows, and scalings below float32.
        "singular_matrix": f"{replace_row('[0,0,0,0]')} {replace_row('[0,1e7,0,0]')}"
        f" {replace_row('[2,0,0,0]')} [[1e-40,0,0,0],[0,1e-40,0,0],[0,0,1e-40,0],[0,0,0,1]]",
        "not_affine": f"{identity.replace('[0,0,0,1]', '[0,0,1,1]')}@/3",
        "coordinate_too_large": large_matrix,
    }
    yield from vary_body("matrix", write_member('"matrix":?'), f"{pointer}/1/matrix", faults)
    faults = {
        "null_value": "null [0,null,0]@/1",
        "wrong_type": '"red" [0,true,0]@/1',
        "wrong_length": "[1,1] [1,1,1,1,1]",
        "out_of_range": "[0,0,255]@/2 [-0.1,0,0]@/0",
    }
    yield from vary_body("color", write_member('"color":?'), f"{pointer}/1/color", faults)
    linear = f'{SPLINE},"degree":1,"knots":["clamped",'
    flat = '"control_points":[[0,0],[1,1]]'
    faults = {
        "null_value": f"{linear}[0,0,1,null]]@/knots/1/3",
        "knots_decrease": f"{linear}[0,2,1,3]]@/knots/1/2",
        "wrong_type": '"type":"triangle","control_net":[[[0,0,0],[1,0,0]],[[0,1,"0"]]]'
        "@/control_net/1/0/2",
        "out_of_range": f'"type":"tube","radius":[1,-1],"curve":{{{flat}}}@/radius/1',
        "empty_domain": f'"type":"tube","radius":1,"curve":{{"type":"bspline",{flat},"degree":1,'
        '"knots":[0,1,1,2]}@/curve/knots',
    }
    yield from vary_body(
        "member",
        write_group(f'[{{"surface":{SURFACE}}},{{"surface":{{?}}}}]'),
        f"{pointer}/1/surface",
        faults,
    )


def build_tree_cases() -> Iterator[HostileBody]:
    """Groups with definitions, with members below others, and with units."""

    def write_tree(members: str, definitions: str = f"[{SURFACE}]") -> str:
        return write_surface(f'"type":"group","definitions":{definitions},"members":{members}')

    faults = {
        "unknown_definition": '[{"definition":1}]@/0/definition [{"definition":-1}]@/0/definition',
        "unknown_parent": '[{"definition":0,"parent":0}]@/0/parent '
        '[{"definition":0},{"parent":1}]@/1/parent [{"parent":1},{"definition":0}]@/0/parent',
        "conflicting_options": f'[{{"definition":0,"surface":{SURFACE}}}]@/0/definition',
        "missing_field": "[{},{}]@/0/surface",
        "wrong_type": '[{"definition":"0"}]@/0/definition '
        '[{"definition":0,"parent":[0]}]@/0/parent',
        "null_value": '[{"definition":null}]@/0/definition',
    }
    pointer = "/surface/members"
    yield from vary_body("members of a tree", write_tree("?"), pointer, faults)
    faults = {
        "wrong_type": "{} 0",
        "null_value": "null [null]@/0",
        "nested_group": '[{"type":"group","members":[]}]@/0/type',
        "too_few_points": '[{"control_net":[[[0,0,0]]]}]@/0/control_net',
    }
    body = write_tree('[{"definition":0}]', "?")
    yield from vary_body("definitions", body, "/surface/definitions", faults)
    chain = ",".join(["{}", *(f'{{"parent":{k}}}' for k in range(100)), '{"definition":0}'])
    yield build_case("a deep tree", write_tree(f"[{chain}]"), "too_deep", f"{pointer}/100/parent")
    name = "x" * 100
    frames = [f'{{"name":"{name}","parent":{k}}}' for k in range(98)]
    copies = [f'{{"name":"{name}","parent":98,"definition":0}}'] * 8000
    members = ",".join([f'{{"name":"{name}"}}', *frames, *copies])
    yield build_case("long paths", write_tree(f"[{members}]"), "wrong_length", pointer)
    members = ",".join(["{}", *['{"definition":0,"parent":0}'] * 65_536])
    yield build_case("too many copies", write_tree(f"[{members}]"), "wrong_length", pointer)
    definitions = ",".join([SURFACE] * 4097)
    body = write_tree('[{"definition":0}]', f"[{definitions}]")
    yield build_case("too many definitions", body, "wrong_length", "/surface/definitions")
    placed = {
        "out_of_range": "[[1e30,0,0,0],[0,1e30,0,0],[0,0,1e30,0],[0,0,0,1]]",
        "singular_matrix": "[[1e5,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
    }
    for code, matrix in placed.items():
        members = f'[{{"matrix":{matrix}}},{{"definition":0,"parent":0,"matrix":{matrix}}}]'
        where = f"{pointer}/1/matrix"
        yield build_case(f"a product of placements: {code}", write_tree(members), code, where)
    units = {
        "out_of_range": "0 -1 1000001",
        "wrong_type": '"mm" [1]',
        "null_value": "null",
        "not_finite": "1e999",
    }
    body = write_surface(f'"type":"group","members":[{{"surface":{SURFACE}}}],"metres_per_unit":?')
    yield from vary_body("unit", body, "/surface/metres_per_unit", units)


def build_sweep_cases() -> Iterator[HostileBody]:
    """Tubes and ribbons with invalid curves, radii or directions."""
    path = '"curve":{"control_points":[[0,0,0],[1,2,0],[3,2,1],[4,0,1]]}'
    faults = {
        "null_value": "null",
        "wrong_type": '"thick" true [1,"2"]@/1',
        "empty_list": "[]",
        "out_of_range": "[1,-1]@/1 -1 [0,0]",
        "coordinate_too_large": "3.4e38",
        "degree_too_high": f"[{'1,' * 65}1]",
    }
    tube = '"type":"tube",'
    pointer = "/surface/radius"
    yield from vary_body("radius", write_surface(f'{tube}{path},"radius":?'), pointer, faults)
    faults = {
        "out_of_range": '"sides":2@sides "sides":2000@sides',
        "wrong_type": '"caps":"flat"@caps',
        "unknown_field": '"width":1@width',
    }
    yield from vary_body("tube", write_surface(f'{tube}{path},"radius":1,?'), "/surface/", faults)
    faults = {
        "degenerate_curve": '{"control_points":[[0,0],[0,0]]}@/control_points',
        "unknown_type": '{"type":"tube"}@/type',
        "null_value": '{"control_points":[[0,0,0],[0,0,null]]}@/control_points/1/2',
    }
    pointer = "/surface/curve"
    yield from vary_body("path", write_surface(f'{tube}"radius":1,"curve":?'), pointer, faults)
    yield build_case("no path", write_surface(f'{tube}"radius":1'), "missing_field", pointer)
    yield build_case(
        "no radius", write_surface(f"{tube}{path}"), "missing_field", "/surface/radius"
    )
    faults = {
        "conflicting_options": '"camera":[0,0,10],"facing":[0,0,1]@camera',
        "wrong_value": '"facing":[0,0,0]@facing "camera":[0,0,1e39]@camera',
        "wrong_dimension": '"camera":[0,1]@camera',
        "null_value": '"camera":null@camera',
    }
    ribbon = f'"type":"ribbon",{path},"width":1,'
    yield from vary_body("ribbon", write_surface(f"{ribbon}?"), "/surface/", faults)


# Texts that are invalid where true or false, or one word of a list, is required.
NOT_FLAGS = {"wrong_type": '1 0 "true" [true]', "null_value": "null"}
NOT_WORDS = {"wrong_value": f'"{NOT_TO_REPEAT}" 3 ["quads"]', "null_value": "null"}
OPTIONS: dict[str, dict[str, str]] = {
    "resolution": {
        "out_of_range": "0 -1 65537 1000000000000 18446744073709551615 [4,0]@/1",
        "wrong_type": '1e3 16.0 1.5 "16" true {} [4,true]@/1 [[4],4]@/0',
        "null_value": "null [null,4]@/0",
        "wrong_length": "[] [4] [4,4,4]",
        "too_many_vertices": "65536 [65536,100]",
    },
    **dict.fromkeys(("normals", "uvs", "curvatures", "weld", "quantize"), NOT_FLAGS),
    **dict.fromkeys(("faces", "oogl", "method", "compression"), NOT_WORDS),
    "crease_angle": {
        "out_of_range": "-0.1 3.2 1e300",
        "null_value": "null",
        "wrong_type": 'true "1"',
    },
    "weld_tolerance": {"out_of_range": "-1e-12 1.1e-6", "null_value": "null"},
    "isocurves": {
        "out_of_range": "-1 1025 [1,-1]@/1",
        "wrong_length": "[1]",
        "null_value": "null [1,null]@/1",
        "wrong_type": "true 1.5",
    },
    "wires": {"wrong_value": f'"{NOT_TO_REPEAT}"', "null_value": "null"},
    "wire_width": {"out_of_range": "0 -1 1e300", "null_value": "null", "wrong_type": '"1"'},
    "wire_sides": {"out_of_range": "2 257", "wrong_type": "8.0"},
    "tolerance": {"out_of_range": "0 1e39", "wrong_type": 'true "0.1"'},
    "relative_tolerance": {"out_of_range": "0 1.001"},
    "angle_tolerance": {"out_of_range": "0 3.2"},
    "max_triangles": {"out_of_range": "0", "wrong_type": "10.0"},
    "max_bytes": {"out_of_range": "-5"},
    "two_sided": {"wrong_type": "1"},
    "overlays": {
        "null_value": "null [null]@/0",
        "wrong_type": '"boundary"',
        "wrong_value": f'["{NOT_TO_REPEAT}"]@/0',
        "repeated_value": '["boundary","boundary"]',
        "wrong_length": '["boundary","control_net","boundary"]',
    },
}
"""Invalid values of options by the code of the error, by the name of the option."""


def build_option_cases() -> Iterator[HostileBody]:
    """Invalid options of a mesh, invalid cameras, and options whose mesh is too large."""
    for name, faults in OPTIONS.items():
        yield from vary_body(name, write_options(f'"{name}":?'), f"/{name}", faults)
    eye, view = '"position":[1,2,3]', '"field_of_view":0.8,"height":9'
    faults = {
        "wrong_type": f'5 {{"position":[1,2,"3"],{view}}}@/position/2'
        f' {{{eye},"field_of_view":0.8,"height":1080.0}}@/height',
        "missing_field": "{}@/position",
        "unknown_field": f'{{{eye},{view},"up":1}}@/up',
        "wrong_dimension": f'{{"position":[1,2],{view}}}@/position',
        "out_of_range": f'{{"position":[1,2,1e39],{view}}}@/position'
        f' {{{eye},"field_of_view":0.8,"height":0}}@/height'
        f' {{{eye},"height":9,"field_of_view":0}}@/field_of_view'
        f' {{{eye},"height":9,"field_of_view":3.15}}@/field_of_view',
    }
    body = write_options('"pixel_tolerance":0.5,"camera":?')
    yield from vary_body("camera", body, "/camera", faults)
    body = f'"camera":{{{eye},{view}}},"pixel_tolerance":0'
    yield build_case("no pixels", write_options(body), "out_of_range", "/pixel_tolerance")
    yield build_case(
        "nothing to draw", write_options('"faces":"none"'), "nothing_to_draw", "/faces"
    )
    body = write_options('"isocurves":1024,"resolution":4000')
    yield build_case("very many isocurves", body, "too_many_vertices", "/resolution")


def write_vertices(count: int, last: str) -> str:
    """A surface of patches with `count` vertices, the last of which is the text `last`."""
    points = "[0.125,0.25,0.5]," * (count - 1) + last
    return write_surface(f'"type":"patches",{ONE_PATCH},"vertices":[{points}]')


def repeat_word(word: str, count: int) -> str:
    """The JSON text of a list with `count` equal elements."""
    return f"[{f'{word},' * (count - 1)}{word}]"


def repeat_value(option: str, word: str) -> str:
    """A request in which an option is a list of 500,001 equal elements."""
    return write_options(f'"{option}":{repeat_word(word, 500_001)}')


def write_many_keys(count: int, end: str) -> str:
    """The JSON text of an object with `count` keys; `end` ends the text."""
    return "{" + ",".join(f'"k{i}":0' for i in range(count)) + end


def write_many_parts() -> str:
    """A surface with 20,000 parts whose patches are null."""
    parts = ",".join(f'"p{i}":[null,null,null]' for i in range(20_000))
    return write_patches(f'{ONE_PATCH},"parts":{{{parts}}}')


def build_long_cases() -> Iterator[HostileBody]:
    """Very long bodies, many of which would become very many Python objects."""
    size = 15 * MIB
    start = b'{"surface":{"control_net":['
    start_of_name = b'{"name":"'
    yield build_long_case("body over the limit", lambda: b" " * (17 * MIB), "body_too_large")
    yield build_long_case("letters", lambda: b"a" * size, "malformed_json")
    yield build_long_case("blanks", lambda: start + b" " * size, "malformed_json")
    yield build_long_case("digits", lambda: start + b"0." + b"1" * size, "malformed_json")
    yield build_long_case(
        "one string", lambda: start_of_name + b"x" * size + b'"}', "missing_field", "/surface"
    )
    yield build_long_case("open lists", lambda: b"[" * size, "too_many_values")
    yield build_long_case("open objects", lambda: b'{"a":' * (size // 5), "too_many_strings")
    yield build_long_case("empty lists", lambda: start + b"[]," * (size // 3), "too_many_values")
    yield build_long_case("empty objects", lambda: start + b"{}," * (size // 3), "too_many_strings")
    yield build_long_case("zeros", lambda: start + b"0," * (size // 2), "too_many_values")
    yield build_long_case("nulls", lambda: start + b"null," * (size // 5), "too_many_values")
    yield build_long_case("texts", lambda: start + b'"1",' * (size // 4), "too_many_strings")
    # While a body arrives, commas and brackets are counted, also those in strings.
    yield build_long_case(
        "string of commas", lambda: start_of_name + b"," * size, "too_many_values"
    )
    yield build_long_case("keys", lambda: write_many_keys(200_000, "}"), "too_many_strings")
    yield build_long_case(
        "unknown keys", lambda: write_many_keys(40_000, "}"), "missing_field", "/surface"
    )
    repeated_key = ',"k7":1}'
    yield build_long_case(
        "key twice in many", lambda: write_many_keys(40_000, repeated_key), "repeated_key", "/k7"
    )
    # The errors have pointers only within the first 512 KiB of a body.
    distant_key = "," + " " * 100_000 + '"k7":1}'
    yield build_long_case(
        "key twice out of sight", lambda: write_many_keys(48_000, distant_key), "repeated_key"
    )
    yield build_long_case("bad parts", write_many_parts, "null_value", "/surface/parts/p0/0")
    body_of_nulls = partial(repeat_value, "overlays", "null")
    yield build_long_case("overlays", body_of_nulls, "null_value", "/overlays/0")
    body_of_numbers = partial(repeat_value, "resolution", "4")
    yield build_long_case("resolutions", body_of_numbers, "wrong_length", "/resolution")
    pointer = "/surface/control_net"
    yield build_long_case(
        "name", lambda: write_surface(f'"name":"{"n" * 900_000}"'), "missing_field", pointer
    )
    row = "[[0,0,0],[0,0,0]]"
    yield build_long_case(
        "net of very many rows",
        lambda: write_net(repeat_word(row, 50_001)),
        "degree_too_high",
        pointer,
    )
    for last, code, suffix in (
        ("[0,0,NaN]", "not_finite", None),  # found by the parser, beyond 512 KiB: no pointer
        ("[0,0,true]", "wrong_type", "/2"),
        ("[0,0]", "wrong_dimension", ""),
        ("[0,0,1e39]", "coordinate_too_large", "/2"),
    ):
        pointer = "" if suffix is None else f"/surface/vertices/49999{suffix}"
        yield build_long_case(
            f"{last} behind many vertices", partial(write_vertices, 50_000, last), code, pointer
        )
    yield build_long_case(
        "vertices true",
        lambda: write_vertices(3, "[0,0,0]" + ",[true,true,true]" * 50_000 + ",[0,0,0]"),
        "wrong_type",
        "/surface/vertices/3/0",
    )
    spline = write_surface('"type":"bspline","degree":64,"control_net":?')
    # 63 × 63 spans of degree 64 have 63² · 65² = 16.8 million Bézier points; 16 are allowed.
    grid = repeat_word(repeat_word("[0,0,0]", 127), 127)
    pointer = "/surface/control_net"
    yield build_long_case(
        "very many spans", lambda: spline.replace("?", grid), "too_many_bezier_points", pointer
    )
    knots = write_surface(f'{SPLINE},"degree":1,"knots":["clamped",?]')
    pointer = "/surface/knots/1"
    yield build_long_case(
        "very many knots",
        lambda: knots.replace("?", repeat_word("0", 300_001)),
        "wrong_length",
        pointer,
    )


HOSTILE: tuple[HostileBody, ...] = (
    *build_text_cases(),
    *build_document_cases(),
    *build_field_cases(),
    *build_spline_cases(),
    *build_repeated_key_cases(),
    *build_net_cases(),
    *build_patch_cases(),
    *build_triangle_cases(),
    *build_group_cases(),
    *build_tree_cases(),
    *build_sweep_cases(),
    *build_option_cases(),
    *build_number_cases(),
    *build_long_cases(),
)
