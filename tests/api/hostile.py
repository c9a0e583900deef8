"""Bodies that mean no good, each with the answer that it must get.

A case tells the status, and the code and the place of the first error. `ECHO` stands in many of
them and must never come back.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

ECHO = "zq9x7"

NET = "[[[0,0,0],[0,1,1]],[[1,0,1],[1,1,2]]]"
GOOD = f'{{"control_net":{NET}}}'
PATCHES = '"type":"patches","vertices":[[0,0,0],[0,1,0],[1,0,0],[1,1,0]]'
GRIDS = '"patches":[[[0,1],[2,3]]]'

MIB = 1 << 20
CHUNK = 1 << 16
"""Bytes that a server hands over at a time."""


def pieces(body: bytes) -> list[bytes]:
    """A body as a server would hand it over; of no bytes, one empty piece."""
    return [body[start : start + CHUNK] for start in range(0, max(len(body), 1), CHUNK)]


@dataclass(frozen=True)
class Hostile:
    """One body; built on demand, for some are long."""

    name: str
    build: Callable[[], bytes]
    status: int
    code: str
    pointer: str

    def chunks(self) -> Iterator[bytes]:
        """The body as it would arrive."""
        yield from pieces(self.build())


def case(name: str, body: str | bytes, status: int, code: str, pointer: str) -> Hostile:
    content = body.encode() if isinstance(body, str) else body
    return Hostile(name, lambda: content, status, code, pointer)


def surface(fields: str) -> str:
    return f'{{"surface":{{{fields}}}}}'


def net(text: str) -> str:
    return surface(f'"control_net":{text}')


def patches(fields: str) -> str:
    return surface(f"{PATCHES},{fields}")


def options(fields: str) -> str:
    return f'{{"surface":{GOOD},{fields}}}'


NOT_NUMBERS = {
    "NaN": ("NaN", "not_finite"),
    "nan": ("nan", "not_finite"),
    "Infinity": ("Infinity", "not_finite"),
    "minus Infinity": ("-Infinity", "not_finite"),
    "1e400": ("1e400", "not_finite"),
    "minus 1e400": ("-1e400", "not_finite"),
    "four hundred digits": ("9" * 400, "not_finite"),
    "text of a number": ('"1.5"', "wrong_type"),
    "text": (f'"{ECHO}"', "wrong_type"),
    "true": ("true", "wrong_type"),
    "false": ("false", "wrong_type"),
    "null": ("null", "null_value"),
    "empty object": ("{}", "wrong_type"),
    "object": (f'{{"{ECHO}":1}}', "wrong_type"),
    "empty list": ("[]", "wrong_type"),
    "list": ("[1]", "wrong_type"),
}

PLACES = {
    "coordinate": (lambda x: net(f"[[[0,0,0],[0,1,{x}]],[[1,0,1],[1,1,2]]]"), "control_net/0/1/2"),
    "last coordinate": (
        lambda x: net(f"[[[0,0,0],[0,1,0]],[[1,0,1],[1,1,{x}]]]"),
        "control_net/1/1/2",
    ),
    "weight": (
        lambda x: surface(f'"control_net":{NET},"weights":[[1,1],[{x},1]]'),
        "weights/1/0",
    ),
    "vertex": (
        lambda x: surface(
            f'"type":"patches",{GRIDS},"vertices":[[0,0,0],[0,{x},0],[1,0,0],[1,1,0]]'
        ),
        "vertices/1/1",
    ),
    "vertex weight": (lambda x: patches(f'{GRIDS},"weights":[1,1,1,{x}]'), "weights/3"),
    "index": (lambda x: patches(f'"patches":[[[0,1],[2,{x}]]]'), "patches/0/1/1"),
    "colour": (
        lambda x: surface(f'"control_net":{NET},"colors":[[[0,0,1],[0,{x},1]]]'),
        "colors/0/1/1",
    ),
    "texture coordinate": (
        lambda x: surface(f'"control_net":{NET},"uvs":[[[{x},0]]]'),
        "uvs/0/0/0",
    ),
    "value of an attribute": (
        lambda x: surface(f'"control_net":{NET},"attributes":{{"a":[[[0]],[[{x}]]]}}'),
        "attributes/a/1/0/0",
    ),
    "patch number": (lambda x: patches(f'{GRIDS},"parts":{{"a":[{x}]}}'), "parts/a/0"),
}


def numbers() -> Iterator[Hostile]:
    """What is no number, wherever a number belongs."""
    for (place, (make, pointer)), (value, (text, code)) in product(
        PLACES.items(), NOT_NUMBERS.items()
    ):
        yield case(f"{value} as a {place}", make(text), 422, code, f"/surface/{pointer}")


def texts() -> Iterator[Hostile]:
    """What is not JSON."""
    yield case("empty body", "", 400, "malformed_json", "")
    yield case("blanks", " \n\t ", 400, "malformed_json", "")
    yield case("byte order mark", b"\xef\xbb\xbf{}", 400, "malformed_json", "")
    yield case("UTF-16", options('"resolution":1').encode("utf-16"), 400, "malformed_json", "")
    yield case("UTF-32", options('"resolution":1').encode("utf-32"), 400, "malformed_json", "")
    yield case("Latin-1", b'{"name":"\xe9"}', 400, "malformed_json", "")
    yield case("zero bytes", b"\0\0\0\0", 400, "malformed_json", "")
    yield case("truncated", net(NET)[:-9], 400, "malformed_json", "/surface/control_net/1/1/0")
    yield case("truncated in a string", '{"surface":{"na', 400, "malformed_json", "/surface/na")
    yield case("two documents", "{}{}", 400, "malformed_json", "")
    yield case("trailing comma", net("[[0,0,0],]"), 400, "malformed_json", "/surface/control_net/0")
    yield case("single quotes", "{'surface':1}", 400, "malformed_json", "")
    yield case("comment", '{"surface":/*x*/1}', 400, "malformed_json", "/surface")
    yield case("unquoted key", "{surface:1}", 400, "malformed_json", "")
    yield case("leading zero", options('"resolution":016'), 400, "malformed_json", "/resolution")
    yield case("leading plus", options('"resolution":+16'), 400, "malformed_json", "/resolution")
    yield case("hexadecimal", options('"resolution":0x10'), 400, "malformed_json", "/resolution")
    yield case("bare point", options('"crease_angle":.5'), 400, "malformed_json", "/crease_angle")
    yield case("undefined", options('"uvs":undefined'), 400, "malformed_json", "/uvs")
    yield case("Python's True", options('"uvs":True'), 400, "malformed_json", "/uvs")
    yield case(
        "line feed in a string", surface('"name":"a\nb"'), 400, "malformed_json", "/surface/name"
    )
    yield case(
        "lone surrogate", surface('"name":"\\ud800"'), 400, "malformed_json", "/surface/name"
    )
    yield case("half an escape", surface('"name":"\\u00"'), 400, "malformed_json", "/surface/name")
    yield case("form", "surface=1&resolution=2", 400, "malformed_json", "")
    yield case("XML", f"<surface>{ECHO}</surface>", 400, "malformed_json", "")
    yield case("deep lists", "[" * 100_000, 422, "too_deep", "")
    yield case("deep objects", '{"a":' * 5000, 422, "too_deep", "")
    yield case("somewhat deep lists", net("[" * 40 + "0" + "]" * 40), 422, "too_deep", "")


def nets() -> Iterator[Hostile]:
    """Control nets of the wrong shape or value."""
    row, at = "[[0,0,0],[0,1,0]]", "/surface/control_net"
    yield case("empty net", net("[]"), 422, "empty_list", at)
    yield case("empty rows", net("[[],[]]"), 422, "empty_list", f"{at}/0")
    yield case("empty points", net("[[[],[]],[[],[]]]"), 422, "empty_list", f"{at}/0/0")
    yield case("a number for a net", net("1"), 422, "wrong_type", at)
    yield case("a text for a net", net(f'"{ECHO}"'), 422, "wrong_type", at)
    yield case("null for a net", net("null"), 422, "null_value", at)
    yield case("true for a net", net("true"), 422, "wrong_type", at)
    yield case("an object for a net", net(f'{{"{ECHO}":[]}}'), 422, "wrong_type", at)
    yield case("a flat net", net("[0,0,0,1]"), 422, "wrong_type", f"{at}/0")
    yield case("a row of numbers", net("[[0,0,0],[0,1,0]]"), 422, "wrong_type", f"{at}/0/0")
    yield case("one level too deep", net("[[[[0,0,0]]]]"), 422, "wrong_dimension", f"{at}/0/0")
    yield case("null for a row", net(f"[{row},null]"), 422, "null_value", f"{at}/1")
    yield case("null for a point", net(f"[{row},[[1,0,0],null]]"), 422, "null_value", f"{at}/1/1")
    yield case("ragged", net(f"[{row},[[0,0,0]]]"), 422, "ragged", f"{at}/1")
    yield case("ragged first", net(f"[[[0,0,0]],{row}]"), 422, "ragged", f"{at}/1")
    yield case("points of two numbers", net("[[[0,0],[0,1]],[[1,0],[1,1]]]"), 422,
               "wrong_dimension", f"{at}/0/0")  # fmt: skip
    yield case("points of four numbers", net("[[[0,0,0,1],[0,1,0,1]],[[1,0,0,1],[1,1,0,1]]]"), 422,
               "wrong_dimension", f"{at}/0/0")  # fmt: skip
    yield case("one short point", net("[[[0,0,0],[0,1,0]],[[1,0,0],[1,1]]]"), 422,
               "wrong_dimension", f"{at}/1/1")  # fmt: skip
    yield case("one point", net("[[[0,0,0]]]"), 422, "too_few_points", at)
    yield case("one row", net(f"[{row}]"), 422, "too_few_points", at)
    yield case("one column", net("[[[0,0,0]],[[1,0,0]]]"), 422, "too_few_points", at)
    for text in ("3.5e38", "-3.5e38", "1e39", "-1e308"):
        yield case(f"coordinate {text}", net(f"[{row},[[1,0,0],[1,{text},0]]]"), 422,
                   "coordinate_too_large", f"{at}/1/1/1")  # fmt: skip
    yield case("degree 65", net(str([[[0, 0, 0]] * 66] * 2)), 422, "degree_too_high", at)
    yield case("degree 999", net(str([[[0, 0, 0]] * 2] * 1000)), 422, "degree_too_high", at)


def weights() -> Iterator[Hostile]:
    """Weights of the wrong shape or value."""
    at = "/surface/weights"

    def weighted(text: str) -> str:
        return surface(f'"control_net":{NET},"weights":{text}')

    yield case("null weights", weighted("null"), 422, "null_value", at)
    yield case("flat weights", weighted("[1,1,1,1]"), 422, "wrong_type", f"{at}/0")
    yield case("one weight", weighted("1"), 422, "wrong_type", at)
    yield case("empty weights", weighted("[]"), 422, "empty_list", at)
    yield case("ragged weights", weighted("[[1,1],[1]]"), 422, "ragged", f"{at}/1")
    yield case("too few weights", weighted("[[1,1]]"), 422, "weights_shape", at)
    yield case("too many weights", weighted("[[1,1,1],[1,1,1]]"), 422, "weights_shape", at)
    yield case("weight 0", weighted("[[1,1],[1,0]]"), 422, "weight_not_positive", f"{at}/1/1")
    yield case("weight -0.0", weighted("[[1,1],[1,-0.0]]"), 422, "weight_not_positive", f"{at}/1/1")
    yield case("weight -1", weighted("[[-1,1],[1,1]]"), 422, "weight_not_positive", f"{at}/0/0")
    yield case("weights far apart", weighted("[[1e-300,1],[1,1e300]]"), 422, "weight_ratio", at)


def patch_lists() -> Iterator[Hostile]:
    """Patches, vertices and parts of the wrong shape or value."""
    at = "/surface/patches"
    for text, code, place in (
        ("[]", "empty_list", ""),
        ("[[]]", "empty_list", "/0"),
        ("[[[]]]", "empty_list", "/0/0"),
        ("null", "null_value", ""),
        ("[0,1,2,3]", "wrong_type", "/0"),
        ("[[0,1],[2,3]]", "wrong_type", "/0/0"),
        ("[[[0,1],[2,3]],[[0,1]]]", "ragged", "/1"),
        ("[[[0,1],[2]]]", "ragged", "/0/1"),
        ("[[[0,1]]]", "too_few_points", ""),
        ("[[[0],[1]]]", "too_few_points", ""),
        ("[[[0,1],[2,4]]]", "index_out_of_range", "/0/1/1"),
        ("[[[0,1],[2,-1]]]", "index_out_of_range", "/0/1/1"),
        ("[[[0,1],[2,1.5]]]", "wrong_type", "/0/1/1"),
        ("[[[0,1],[2,3.0]]]", "wrong_type", "/0/1/1"),
        ("[[[0,1],[2,9007199254740993]]]", "index_out_of_range", "/0/1/1"),
        ("[[[0,1],[2,18446744073709551615]]]", "index_out_of_range", "/0/1/1"),
        ("[[[0,1],[2,99999999999999999999]]]", "wrong_type", "/0/1/1"),
    ):
        yield case(f"patches {text}", patches(f'"patches":{text}'), 422, code, at + place)
    no_vertices = f'"type":"patches",{GRIDS}'
    yield case("no vertices", surface(f'{no_vertices},"vertices":[]'), 422, "empty_list",
               "/surface/vertices")  # fmt: skip
    yield case("vertices left out", surface(no_vertices), 422, "missing_field", "/surface/vertices")
    yield case("patches left out", surface(PATCHES), 422, "missing_field", "/surface/patches")
    yield case("flat vertices", surface(f'{no_vertices},"vertices":[0,0,0]'), 422, "wrong_type",
               "/surface/vertices/0")  # fmt: skip
    yield case("a weight too few", patches(f'{GRIDS},"weights":[1,1,1]'), 422, "weights_shape",
               "/surface/weights")  # fmt: skip
    yield case("vertex weight 0", patches(f'{GRIDS},"weights":[1,1,1,0]'), 422,
               "weight_not_positive", "/surface/weights/3")  # fmt: skip
    at = "/surface/parts"
    long = "k" * 101
    for text, code, place in (
        ("null", "null_value", ""),
        ("[]", "wrong_type", ""),
        ('{"a":null}', "null_value", "/a"),
        ('{"a":0}', "wrong_type", "/a"),
        ('{"a":[]}', "empty_list", "/a"),
        ('{"a":[1]}', "index_out_of_range", "/a/0"),
        ('{"a":[-1]}', "index_out_of_range", "/a/0"),
        ('{"a":[0,0]}', "repeated_patch", "/a/1"),
        ('{"a":[0],"b":[0]}', "repeated_patch", "/b/0"),
        ('{"":[0]}', "wrong_length", "/"),
        ('{"a/b~":[true]}', "wrong_type", "/a~1b~0/0"),
        (f'{{"{long}":[0]}}', "wrong_length", "/" + "k" * 64 + "…"),
        ('{"a\\u0000":[0]}', "wrong_value", "/a\0"),
    ):
        yield case(f"parts {text[:20]}", patches(f'{GRIDS},"parts":{text}'), 422, code, at + place)


def triangle_rows() -> Iterator[Hostile]:
    """Rows of triangles of the wrong shape or value."""
    at, first = "/surface/control_net", "[[0,0,0],[1,0,0],[2,0,0]]"

    def triangle(text: str, more: str = "") -> str:
        return surface(f'"type":"triangle","control_net":{text}{more}')

    for text, code, place in (
        ("null", "null_value", ""),
        ("[]", "empty_list", ""),
        (f'"{ECHO}"', "wrong_type", ""),
        ("[[[0,0,0]]]", "too_few_points", ""),
        (f"[{first}]", "ragged", "/0"),
        (f"[{first},[[0,1,0],[1,1,0]]]", "ragged", "/0"),
        (f"[{first},[[0,1,0]],[[0,2,0]]]", "ragged", "/1"),
        (f"[{first},[[0,1,0],[1,1,0]],[[0,2,0],[0,0,0]]]", "ragged", "/2"),
        (f"[{first},[[0,1,0],[1,1,0]],[]]", "empty_list", "/2"),
        (f"[{first},[[0,1,0],[1,1]],[[0,2,0]]]", "wrong_dimension", "/1/1"),
        (f"[{first},[[0,1,0],[1,1,true]],[[0,2,0]]]", "wrong_type", "/1/1/2"),
        (f"[{first},[[0,1,0],null],[[0,2,0]]]", "null_value", "/1/1"),
        (f"[{first},[[0,1,0],[1,1,0]],[[0,2e38,4e38]]]", "coordinate_too_large", "/2/0/2"),
        (str([[[0, 0, 0]] * (66 - m) for m in range(66)]), "degree_too_high", ""),
        (str([[]] * 10_000), "degree_too_high", ""),
    ):
        yield case(f"triangle {text[:60]}", triangle(text), 422, code, at + place)
    net_ = f"[{first},[[0,1,0],[1,1,0]],[[0,2,0]]]"
    for field, text, code, place in (
        ("weights", "null", "null_value", ""),
        ("weights", "[1,1,1,1,1,1]", "wrong_type", "/0"),
        ("weights", "[[1,1],[1]]", "weights_shape", ""),
        ("weights", "[[1,1,1],[1,1,1],[1]]", "ragged", "/1"),
        ("weights", "[[1,1,1],[1,0],[1]]", "weight_not_positive", "/1/1"),
        ("colors", "[[[0,0,0],[1,1,1]],[[1,0,2]]]", "out_of_range", "/1/0/2"),
        ("colors", "[[[0,0,0],[1,1,1]],[[1,0,1],[1,0,0]]]", "ragged", "/1"),
        ("uvs", "[[[0,0],[0,1]],[[1,0,1]]]", "wrong_dimension", "/1/0"),
        ("attributes", '{"a~b":[[[1]]]}', "wrong_value", "/a~0b"),
        ("attributes", '{"a":[[[1],[2]],[[1e39]]]}', "coordinate_too_large", "/a/1/0/0"),
    ):
        body = triangle(net_, f',"{field}":{text}')
        yield case(f"triangle {field} {text}", body, 422, code, f"/surface/{field}{place}")
    at = "/surface/triangles"
    for text, code, place in (
        ("null", "null_value", ""),
        ("[]", "empty_list", ""),
        ("[[0,1],[2]]", "wrong_type", "/0/0"),
        ("[[[0,1]]]", "ragged", "/0/0"),
        ("[[[0,1],[2]],[[0]]]", "ragged", "/1"),
        ("[[[0]]]", "too_few_points", ""),
        ("[[[0,1],[4]]]", "index_out_of_range", "/0/1/0"),
        ("[[[1,2],[3]],[[0,-1],[2]]]", "index_out_of_range", "/1/0/1"),
        ("[[[0,1],[2.0]]]", "wrong_type", "/0/1/0"),
    ):
        yield case(f"triangles {text}", patches(f'"triangles":{text}'), 422, code, at + place)
    text = '"triangles":[[[0,1],[2]]],"parts":{"a":[0,2]}'
    yield case("a part beyond the triangles", patches(f"{GRIDS},{text}"), 422,
               "index_out_of_range", "/surface/parts/a/1")  # fmt: skip


def wholes() -> Iterator[Hostile]:
    """Documents, surfaces and fields that are something else."""
    for text in ("[]", "1", f'"{ECHO}"', "true", "[[0,0,0],[1,1,1]]"):
        yield case(f"document {text}", text, 422, "wrong_type", "")
    yield case("document null", "null", 422, "null_value", "")
    yield case("document {}", "{}", 422, "missing_field", "/surface")
    for text in ("[]", "1", f'"{ECHO}"', "true", NET):
        yield case(f"surface {text}", f'{{"surface":{text}}}', 422, "wrong_type", "/surface")
    yield case("surface null", '{"surface":null}', 422, "null_value", "/surface")
    yield case("surface {}", '{"surface":{}}', 422, "missing_field", "/surface/control_net")
    for text, code in (
        (f'"{ECHO}"', "unknown_type"),
        ('"Bezier"', "unknown_type"),
        ('""', "unknown_type"),
        ("null", "null_value"),
        ("1", "wrong_type"),
        ('["bezier"]', "wrong_type"),
        ("{}", "wrong_type"),
    ):
        body = surface(f'"type":{text},"control_net":{NET}')
        yield case(f"type {text}", body, 422, code, "/surface/type")
    yield case("bezier with patches", surface(f'"control_net":{NET},{GRIDS}'), 422,
               "unknown_field", "/surface/patches")  # fmt: skip
    yield case("patches with a net", patches(f'{GRIDS},"control_net":{NET}'), 422,
               "unknown_field", "/surface/control_net")  # fmt: skip
    yield case("unknown field", options(f'"colour":"{ECHO}"'), 422, "unknown_field", "/colour")
    yield case("unknown field of a surface", surface(f'"control_net":{NET},"knots":null'), 422,
               "unknown_field", "/surface/knots")  # fmt: skip
    yield case("format in the body", options('"format":"glb"'), 422, "unknown_field", "/format")
    yield case("other case", options('"Resolution":4'), 422, "unknown_field", "/Resolution")
    yield case("prototype", options('"__proto__":{}'), 422, "unknown_field", "/__proto__")
    yield case("long key", options(f'"{"k" * 5000}":1'), 422, "unknown_field", "/" + "k" * 64 + "…")
    for text, code in (
        ('"x"', "wrong_value"),
        ('"Y"', "wrong_value"),
        ("null", "null_value"),
        ("2", "wrong_value"),
    ):
        yield case(
            f"up {text}", surface(f'"control_net":{NET},"up":{text}'), 422, code, "/surface/up"
        )
    for text, code in (
        ('""', "wrong_length"),
        (f'"{"n" * 101}"', "wrong_length"),
        ('"a\\nb"', "wrong_value"),
        ('"\\u0000"', "wrong_value"),
        ('"\\u2028"', "wrong_value"),
        ("null", "null_value"),
        ("5", "wrong_type"),
    ):
        body = surface(f'"control_net":{NET},"name":{text}')
        yield case(f"name {text[:10]}", body, 422, code, "/surface/name")


def repeated() -> Iterator[Hostile]:
    """Keys that are said twice, at every level."""
    at = "repeated_key"
    yield case("surface twice", f'{{"surface":{GOOD},"surface":{GOOD}}}', 422, at, "/surface")
    yield case("option twice", options('"uvs":true,"uvs":false'), 422, at, "/uvs")
    yield case("option twice, escaped", options('"uvs":true,"\\u0075vs":true'), 422, at, "/uvs")
    yield case("net twice", surface(f'"control_net":{NET},"control_net":{NET}'), 422, at,
               "/surface/control_net")  # fmt: skip
    yield case("part twice", patches(f'{GRIDS},"parts":{{"a":[0],"a":[0]}}'), 422, at,
               "/surface/parts/a")  # fmt: skip
    yield case("key twice in a list", net('[[0],{"a":1,"a":2}]'), 422, at,
               "/surface/control_net/1/a")  # fmt: skip
    yield case("key twice and a colon in a name", surface('"name":"a:b","name":"c"'), 422, at,
               "/surface/name")  # fmt: skip


SPLINE = f'"type":"bspline","control_net":{NET}'


def splines() -> Iterator[Hostile]:
    """B-splines whose degrees and knots are something else."""
    at = "/surface/knots"
    for text, code, place in (
        ("null", "null_value", ""),
        ("1", "wrong_type", ""),
        ("{}", "wrong_type", ""),
        (f'"{ECHO}"', "wrong_value", ""),
        ("[]", "wrong_length", ""),
        ('["clamped"]', "wrong_length", ""),
        ("[0,0,1,1]", "wrong_length", ""),
        ("[0,1]", "wrong_type", "/0"),
        (f'["clamped","{ECHO}"]', "wrong_value", "/1"),
        ('["clamped",null]', "null_value", "/1"),
        ('["clamped",true]', "wrong_type", "/1"),
        ('["clamped",[]]', "empty_list", "/1"),
        ('["clamped",[[0,0,1,1]]]', "wrong_type", "/1/0"),
        ('["clamped",[0,0,1,"1"]]', "wrong_type", "/1/3"),
        ('["clamped",[0,0,1,null]]', "null_value", "/1/3"),
        ('["clamped",[0,0,1,true]]', "wrong_type", "/1/3"),
        ('["clamped",[0,0,1]]', "wrong_length", "/1"),
        ('["clamped",[0,0,1,1,1]]', "wrong_length", "/1"),
        ('["clamped",[0,1,0,1]]', "knots_decrease", "/1/2"),
        ('["clamped",[0,1,1,2]]', "empty_domain", "/1"),
        ('["clamped",[0,0,1e-300,1e39]]', "knot_too_large", "/1/3"),
        ('["clamped",[-1e308,-1e308,1e308,1e308]]', "knot_too_large", "/1/0"),
        ('["clamped",[0,1e9,1000000001,2e9]]', "knots_too_close", "/1/2"),
        ('["clamped",[0,0,5e-324,5e-324]]', "knots_too_close", "/1/2"),
        ('["clamped",[0,0,1e-39,1e-39]]', "knots_too_close", "/1/2"),
        ('"periodic"', "too_few_points", "/../control_net"),
    ):
        where = "/surface/control_net" if ".." in place else at + place
        body = surface(f'{SPLINE},"degree":1,"knots":{text}')
        yield case(f"spline knots {text}", body, 422, code, where)
    at = "/surface/degree"
    for text, code, place in (
        ("null", "null_value", ""),
        ("0", "out_of_range", ""),
        ("-1", "out_of_range", ""),
        ("65", "degree_too_high", ""),
        ("99999999999999999999", "wrong_type", ""),
        ("1.0", "wrong_type", ""),
        ("true", "wrong_type", ""),
        ('"3"', "wrong_type", ""),
        ("{}", "wrong_type", ""),
        ("[]", "wrong_length", ""),
        ("[1,1,1]", "wrong_length", ""),
        ("[1,null]", "null_value", "/1"),
        ("[1,1.5]", "wrong_type", "/1"),
        ("[0,1]", "out_of_range", "/0"),
        ("[1,65]", "degree_too_high", "/1"),
        ("[1,18446744073709551615]", "degree_too_high", "/1"),
    ):
        yield case(
            f"spline degree {text}", surface(f'{SPLINE},"degree":{text}'), 422, code, at + place
        )
    yield case("fewer points than the degree", surface(SPLINE), 422, "too_few_points",
               "/surface/control_net")  # fmt: skip
    yield case("spline weights of another form", surface(f'{SPLINE},"degree":1,"weights":[[1,1]]'),
               422, "weights_shape", "/surface/weights")  # fmt: skip
    yield case("spline without a net", surface('"type":"bspline"'), 422, "missing_field",
               "/surface/control_net")  # fmt: skip
    yield case("spline with vertices", surface(f'{SPLINE},"degree":1,"vertices":[[0,0,0]]'), 422,
               "unknown_field", "/surface/vertices")  # fmt: skip


def groups() -> Iterator[Hostile]:
    """Groups whose members, names, colours or places are something else."""
    at, identity = "/surface/members", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"

    def group(members: str) -> str:
        return surface(f'"type":"group","members":{members}')

    def member(fields: str) -> str:
        return group(f'[{{"surface":{GOOD}}},{{"surface":{GOOD},{fields}}}]')

    for text, code, place in (
        ("[]", "wrong_length", ""),
        ("{}", "wrong_type", ""),
        ("null", "null_value", ""),
        ("[1]", "wrong_type", "/0"),
        ("[null]", "null_value", "/0"),
        ("[{}]", "missing_field", "/0/surface"),
        ('[{"surface":null}]', "null_value", "/0/surface"),
        ('[{"surface":{"type":"group","members":[]}}]', "nested_group", "/0/surface/type"),
        ('[{"surface":{"type":"tvist"}}]', "unknown_type", "/0/surface/type"),
        (f'[{{"surface":{{"control_net":{NET},"up":"x"}}}}]', "wrong_value", "/0/surface/up"),
        ('[{"surface":{"control_net":[[[0,0,0]]]}}]', "too_few_points", "/0/surface/control_net"),
        ('[{"surface":{"control_net":[[["0",0,0]]]}}]', "wrong_type",
         "/0/surface/control_net/0/0/0"),
        (f'[{{"surface":{GOOD},"{ECHO}":1}}]', "unknown_field", f"/0/{ECHO}"),
        (f'[{{"surface":{GOOD},"name":"a","name":"b"}}]', "repeated_key", "/0/name"),
    ):  # fmt: skip
        yield case(f"members {text[:90]}", group(text), 422, code, at + place)
    deep = '{"type":"group","members":[{"surface":' * 8 + GOOD + "}]}" * 8
    yield case("groups in groups", f'{{"surface":{deep}}}', 422, "nested_group",
               f"{at}/0/surface/type")  # fmt: skip
    yield case("members left out", surface('"type":"group"'), 422, "missing_field", at)
    yield case("too many members", group(f'[{",".join([f"""{{"surface":{GOOD}}}"""] * 4097)}]'),
               422, "wrong_length", at)  # fmt: skip
    for text, code, place in (
        ("null", "null_value", ""),
        ("1", "wrong_type", ""),
        ("[]", "empty_list", ""),
        ("[1,0,0,0]", "wrong_type", "/0"),
        ("[[1,0,0],[0,1,0],[0,0,1]]", "wrong_dimension", ""),
        (identity.replace("[0,1,0,0]", "[0,1,0]"), "ragged", "/1"),
        (identity.replace("[0,1,0,0]", "[0,true,0,0]"), "wrong_type", "/1/1"),
        (identity.replace("[0,1,0,0]", "[0,1,0,1e308]"), "out_of_range", "/1/3"),
        (identity.replace("[0,1,0,0]", "[0,1,0,NaN]"), "not_finite", "/1/3"),
        (identity.replace("[0,1,0,0]", "[0,0,0,0]"), "singular_matrix", ""),
        (identity.replace("[0,0,0,1]", "[0,0,1,1]"), "not_affine", "/3"),
    ):
        yield case(f"matrix {text}", member(f'"matrix":{text}'), 422, code, f"{at}/1/matrix{place}")
    far = identity.replace("[0,1,0,0]", "[0,3e38,0,3e38]").replace("1,0", "3e38,0")
    yield case("placed too far away", member(f'"matrix":{far.replace("[0,0,1", "[0,0,3e38")}'), 422,
               "coordinate_too_large", f"{at}/1/matrix")  # fmt: skip
    spline = '"type":"bspline","degree":1'
    for text, code, place in (
        (f'{spline},"control_net":{NET},"knots":["clamped",[0,0,1,null]]', "null_value",
         "knots/1/3"),
        (f'{spline},"control_net":{NET},"knots":["clamped",[0,2,1,3]]', "knots_decrease",
         "knots/1/2"),
        ('"type":"triangle","control_net":[[[0,0,0],[1,0,0]],[[0,1,"0"]]]', "wrong_type",
         "control_net/1/0/2"),
        ('"type":"tube","radius":[1,-1],"curve":{"control_points":[[0,0],[1,1]]}', "out_of_range",
         "radius/1"),
        ('"type":"tube","radius":1,"curve":{"type":"bspline","control_points":[[0,0],[1,1]],'
         '"degree":1,"knots":[0,1,1,2]}', "empty_domain", "curve/knots"),
    ):  # fmt: skip
        yield case(f"member {text}", group(f'[{{"surface":{GOOD}}},{{"surface":{{{text}}}}}]'), 422,
                   code, f"{at}/1/surface/{place}")  # fmt: skip
    for text, code, place in (
        ("null", "null_value", ""),
        ('"red"', "wrong_type", ""),
        ("[1,1]", "wrong_length", ""),
        ("[1,1,1,1,1]", "wrong_length", ""),
        ("[0,0,255]", "out_of_range", "/2"),
        ("[-0.1,0,0]", "out_of_range", "/0"),
        ("[0,true,0]", "wrong_type", "/1"),
        ("[0,null,0]", "null_value", "/1"),
    ):
        yield case(f"color {text}", member(f'"color":{text}'), 422, code, f"{at}/1/color{place}")


def choices() -> Iterator[Hostile]:
    """Options of the wrong type or out of range."""
    for text, code, place in (
        ("0", "out_of_range", ""),
        ("-1", "out_of_range", ""),
        ("65537", "out_of_range", ""),
        ("1000000000000", "out_of_range", ""),
        ("18446744073709551615", "out_of_range", ""),
        ("1e3", "wrong_type", ""),
        ("16.0", "wrong_type", ""),
        ("1.5", "wrong_type", ""),
        ('"16"', "wrong_type", ""),
        ("true", "wrong_type", ""),
        ("null", "null_value", ""),
        ("{}", "wrong_type", ""),
        ("[]", "wrong_length", ""),
        ("[4]", "wrong_length", ""),
        ("[4,4,4]", "wrong_length", ""),
        ("[4,0]", "out_of_range", "/1"),
        ("[4,true]", "wrong_type", "/1"),
        ("[null,4]", "null_value", "/0"),
        ("[[4],4]", "wrong_type", "/0"),
        ("65536", "too_many_vertices", ""),
        ("[65536,100]", "too_many_vertices", ""),
    ):
        body = options(f'"resolution":{text}')
        yield case(f"resolution {text}", body, 422, code, "/resolution" + place)
    for name in ("normals", "uvs", "curvatures", "weld"):
        for text, code in (
            ("1", "wrong_type"), ("0", "wrong_type"), ('"true"', "wrong_type"),
            ("null", "null_value"), ("[true]", "wrong_type"),
        ):  # fmt: skip
            yield case(f"{name} {text}", options(f'"{name}":{text}'), 422, code, f"/{name}")
    for name in ("faces", "oogl", "method"):
        for text, code in (
            (f'"{ECHO}"', "wrong_value"), ("null", "null_value"), ("3", "wrong_value"),
            ('["quads"]', "wrong_value"),
        ):  # fmt: skip
            yield case(f"{name} {text}", options(f'"{name}":{text}'), 422, code, f"/{name}")
    for text, code in (
        ("-0.1", "out_of_range"), ("3.2", "out_of_range"), ("1e300", "out_of_range"),
        ("null", "null_value"), ("true", "wrong_type"), ('"1"', "wrong_type"),
    ):  # fmt: skip
        body = options(f'"crease_angle":{text}')
        yield case(f"crease angle {text}", body, 422, code, "/crease_angle")
    for text, code, place in (
        ("-1", "out_of_range", ""),
        ("1025", "out_of_range", ""),
        ("[1]", "wrong_length", ""),
        ("[1,-1]", "out_of_range", "/1"),
        ("[1,null]", "null_value", "/1"),
        ("true", "wrong_type", ""),
        ("null", "null_value", ""),
        ("1.5", "wrong_type", ""),
    ):
        yield case(f"isocurves {text}", options(f'"isocurves":{text}'), 422, code,
                   f"/isocurves{place}")  # fmt: skip
    for name, text, code in (
        ("wires", f'"{ECHO}"', "wrong_value"), ("wires", "null", "null_value"),
        ("wire_width", "0", "out_of_range"), ("wire_width", "-1", "out_of_range"),
        ("wire_width", "1e300", "out_of_range"), ("wire_width", "null", "null_value"),
        ("wire_width", '"1"', "wrong_type"), ("wire_sides", "2", "out_of_range"),
        ("wire_sides", "257", "out_of_range"), ("wire_sides", "8.0", "wrong_type"),
    ):  # fmt: skip
        yield case(f"{name} {text}", options(f'"{name}":{text}'), 422, code, f"/{name}")
    yield case("nothing to draw", options('"faces":"none"'), 422, "nothing_to_draw", "/faces")
    yield case("very many isocurves", options('"isocurves":1024,"resolution":4000'), 422,
               "too_many_vertices", "/resolution")  # fmt: skip
    for text, code, place in (
        ("null", "null_value", ""),
        ('"boundary"', "wrong_type", ""),
        ("[null]", "null_value", "/0"),
        (f'["{ECHO}"]', "wrong_value", "/0"),
        ('["boundary","boundary"]', "repeated_value", ""),
        ('["boundary","control_net","boundary"]', "wrong_length", ""),
    ):
        yield case(
            f"overlays {text}", options(f'"overlays":{text}'), 422, code, "/overlays" + place
        )


def long(name: str, build: Callable[[], bytes], status: int, code: str, pointer: str) -> Hostile:
    return Hostile(f"long: {name}", build, status, code, pointer)


def vertices(count: int, last: str) -> bytes:
    """A net of many vertices whose last one is `last`."""
    points = "[0.125,0.25,0.5]," * (count - 1) + last
    return surface(f'"type":"patches",{GRIDS},"vertices":[{points}]').encode()


def many_keys(count: int, end: str) -> bytes:
    """An object of many keys."""
    return ("{" + ",".join(f'"k{i}":0' for i in range(count)) + end).encode()


def giants() -> Iterator[Hostile]:
    """Bombs: many bytes, or bytes that would become very many objects."""
    size = 15 * MIB
    start = b'{"surface":{"control_net":['
    yield long("body over the limit", lambda: b" " * (17 * MIB), 413, "body_too_large", "")
    yield long("letters", lambda: b"a" * size, 400, "malformed_json", "")
    yield long("blanks", lambda: start + b" " * size, 400, "malformed_json", "")
    yield long("digits", lambda: start + b"0." + b"1" * size, 400, "malformed_json", "")
    yield long("one string", lambda: b'{"name":"' + b"x" * size + b'"}', 422,
               "missing_field", "/surface")  # fmt: skip
    yield long("open lists", lambda: b"[" * size, 422, "too_many_values", "")
    yield long("open objects", lambda: b'{"a":' * (size // 5), 422, "too_many_strings", "")
    yield long("empty lists", lambda: start + b"[]," * (size // 3), 422, "too_many_values", "")
    yield long("empty objects", lambda: start + b"{}," * (size // 3), 422, "too_many_strings", "")
    yield long("zeros", lambda: start + b"0," * (size // 2), 422, "too_many_values", "")
    yield long("nulls", lambda: start + b"null," * (size // 5), 422, "too_many_values", "")
    yield long("texts", lambda: start + b'"1",' * (size // 4), 422, "too_many_strings", "")
    yield long("string of commas", lambda: b'{"name":"' + b"," * size, 422, "too_many_values", "")
    yield long(
        "keys",
        lambda: many_keys(2_000_000, "}"),
        422,
        "too_many_strings",
        "",
    )
    yield long(
        "unknown keys",
        lambda: many_keys(40_000, "}"),
        422,
        "missing_field",
        "/surface",
    )
    yield long(
        "repeated key after many",
        lambda: many_keys(40_000, ',"k7":1}'),
        422,
        "repeated_key",
        "/k7",
    )
    yield long(
        "repeated key out of sight",
        lambda: many_keys(48_000, "," + " " * 100_000 + '"k7":1}'),
        422,
        "repeated_key",
        "",
    )
    yield long(
        "bad parts",
        lambda: patches(
            f'{GRIDS},"parts":{{{",".join(f""""p{i}":[null,null,null]""" for i in range(20_000))}}}'
        ).encode(),
        422,
        "null_value",
        "/surface/parts/p0/0",
    )
    yield long(
        "overlays",
        lambda: options(f'"overlays":[{"null," * 500_000}null]').encode(),
        422,
        "null_value",
        "/overlays/0",
    )
    yield long(
        "resolutions",
        lambda: options(f'"resolution":[{"4," * 500_000}4]').encode(),
        422,
        "wrong_length",
        "/resolution",
    )
    yield long("name", lambda: surface(f'"name":"{"n" * 900_000}"').encode(), 422,
               "missing_field", "/surface/control_net")  # fmt: skip
    yield long(
        "net of very many rows",
        lambda: net(f"[{'[[0,0,0],[0,0,0]],' * 50_000}[[0,0,0],[0,0,0]]]").encode(),
        422,
        "degree_too_high",
        "/surface/control_net",
    )
    yield long("NaN behind many vertices", lambda: vertices(50_000, "[0,0,NaN]"), 422,
               "not_finite", "")  # fmt: skip
    yield long("true behind many vertices", lambda: vertices(50_000, "[0,0,true]"), 422,
               "wrong_type", "/surface/vertices/49999/2")  # fmt: skip
    yield long("short one behind many vertices", lambda: vertices(50_000, "[0,0]"), 422,
               "wrong_dimension", "/surface/vertices/49999")  # fmt: skip
    yield long("large one behind many vertices", lambda: vertices(50_000, "[0,0,1e39]"), 422,
               "coordinate_too_large", "/surface/vertices/49999/2")  # fmt: skip
    yield long("all vertices true", lambda: vertices(2, "[0,0,0]").replace(
        b"0.125,0.25,0.5", b"0,0,0],[" + b"true,true,true],[" * 50_000 + b"0,0,0"), 422,
               "wrong_type", "/surface/vertices/1/0")  # fmt: skip
    row = "[0,0,0]," * 141 + "[0,0,0]"
    yield long("very many spans", lambda: surface(
        f'"type":"bspline","degree":16,"control_net":[{f"[{row}]," * 141}[{row}]]').encode(), 422,
               "too_many_bezier_points", "/surface/control_net")  # fmt: skip
    yield long("very many knots", lambda: surface(
        f'{SPLINE},"degree":1,"knots":["clamped",[{"0," * 300_000}1]]').encode(), 422,
               "wrong_length", "/surface/knots/1")  # fmt: skip


HOSTILE: tuple[Hostile, ...] = (
    *texts(),
    *wholes(),
    *splines(),
    *repeated(),
    *nets(),
    *weights(),
    *patch_lists(),
    *triangle_rows(),
    *groups(),
    *choices(),
    *numbers(),
    *giants(),
)


def query(fields: str) -> str:
    return f'{{"surface":{GOOD},{fields}}}'


def queries() -> Iterator[Hostile]:
    """Points of /v1/points that are none."""
    for value, (text, code) in NOT_NUMBERS.items():
        body = query(f'"uv":[[0,0],[0,{text}]]')
        yield case(f"{value} as a parameter", body, 422, code, "/uv/1/1")
    for text, code, place in (
        ("null", "null_value", ""),
        ("[]", "empty_list", ""),
        ("[0.5,0.5]", "wrong_type", "/0"),
        ("[[]]", "empty_list", "/0"),
        ("[[0.5]]", "wrong_dimension", "/0"),
        ("[[0,0],[0,0,0]]", "wrong_dimension", "/1"),
        ("[[0,0],null]", "null_value", "/1"),
        ("{}", "wrong_type", ""),
        ("[[0,0],[0,1.0000000000000002]]", "outside_domain", "/1/1"),
        ("[[-5e-324,0]]", "outside_domain", "/0/0"),
        ("[[1e308,0]]", "outside_domain", "/0/0"),
    ):
        yield case(f"uv {text}", query(f'"uv":{text}'), 422, code, "/uv" + place)
    yield case("no uv", query('"derivatives":1'), 422, "missing_field", "/uv")
    yield case("both kinds of places", query('"uv":[[0,0]],"barycentric":[[1,0,0]]'), 422,
               "conflicting_options", "/barycentric")  # fmt: skip
    yield case("barycentric places of a square", query('"barycentric":[[1,0,0]]'), 422,
               "wrong_parameters", "/barycentric/0")  # fmt: skip
    yield case("two barycentric coordinates", query('"barycentric":[[1,0,0],[1,0]]'), 422,
               "wrong_dimension", "/barycentric/1")  # fmt: skip
    yield case("barycentric null", query('"barycentric":null'), 422, "null_value", "/barycentric")
    for text, code in (
        ("3", "out_of_range"), ("-1", "out_of_range"), ("1.0", "wrong_type"),
        ("true", "wrong_type"), ('"1"', "wrong_type"), ("null", "null_value"),
        ("[1]", "wrong_type"),
    ):  # fmt: skip
        body = query(f'"uv":[[0,0]],"derivatives":{text}')
        yield case(f"derivatives {text}", body, 422, code, "/derivatives")
    yield case("a mesh option", query('"uv":[[0,0]],"resolution":4'), 422, "unknown_field",
               "/resolution")  # fmt: skip
    yield case("a patch of one", query('"uv":[[0,0]],"patch":0'), 422, "unexpected_patch", "/patch")
    several = patches('"patches":[[[0,1],[2,3]],[[0,1],[2,3]]]')[:-1]
    yield case("no patch", f'{several},"uv":[[0,0]]}}', 422, "missing_field", "/patch")
    for text, code, place in (
        ("null", "null_value", ""),
        ("2", "index_out_of_range", ""),
        ("-1", "index_out_of_range", ""),
        ("18446744073709551615", "index_out_of_range", ""),
        ("1.0", "wrong_type", ""),
        ("true", "wrong_type", ""),
        ('"0"', "wrong_type", ""),
        ("{}", "wrong_type", ""),
        ("[]", "empty_list", ""),
        ("[0]", "wrong_length", ""),
        ("[0,0,0]", "wrong_length", ""),
        ("[0,2]", "index_out_of_range", "/1"),
        ("[0,null]", "null_value", "/1"),
        ("[0,true]", "wrong_type", "/1"),
        ("[[0],0]", "wrong_type", "/0"),
        ("[0,18446744073709551615]", "index_out_of_range", "/1"),
    ):
        body = f'{several},"uv":[[0,0],[1,1]],"patch":{text}}}'
        yield case(f"patch {text}", body, 422, code, "/patch" + place)
    yield long("very many points", lambda: query(f'"uv":[{"[0,0]," * 300_000}[0,0]]').encode(), 422,
               "too_many_points", "/uv")  # fmt: skip
    yield long("empty points", lambda: query(f'"uv":[{"[]," * 3_000_000}[]]').encode(), 422,
               "too_many_values", "")  # fmt: skip
    yield long("points of very many numbers", lambda: query(f'"uv":[[{"0," * 900_000}0]]').encode(),
               422, "wrong_dimension", "/uv/0")  # fmt: skip


QUERIES: tuple[Hostile, ...] = tuple(queries())
"""The same for POST /v1/points."""


def stores() -> Iterator[Hostile]:
    """Bodies for storing that hold something else than a surface, or something beside it."""
    for text in ("[]", "1", f'"{ECHO}"', "true", NET):
        yield case(f"document {text}", text, 422, "wrong_type", "")
    yield case("document null", "null", 422, "null_value", "")
    yield case("document {}", "{}", 422, "missing_field", "/surface")
    yield case("surface null", '{"surface":null}', 422, "null_value", "/surface")
    yield case("an id", '{"surface":"saddle"}', 422, "wrong_type", "/surface")
    yield case("the surface alone", GOOD, 422, "missing_field", "/surface")
    for field in (
        f'"id":"{"0" * 64}"', f'"name":"{ECHO}"', '"resolution":4', '"up":"z"', '"camera":null',
        '"engine":2', '"surfaces":[]', '"links":{}',
    ):  # fmt: skip
        name = field.partition(":")[0].strip('"')
        yield case(f"{name} beside it", options(field), 422, "unknown_field", f"/{name}")
    yield case("two surfaces", f'{{"surface":{GOOD},"surface":{GOOD}}}', 422, "repeated_key",
               "/surface")  # fmt: skip
    yield case("truncated", options('"x":1')[:-1], 400, "malformed_json", "/x")
    yield case("not finite", net("[[[0,0,0],[0,1,NaN]]]"), 422, "not_finite",
               "/surface/control_net/0/1/2")  # fmt: skip
    yield case("a canonical content", b'{"arrays":[],"canonical":1,"surface":{}}\n', 422,
               "missing_field", "/surface/control_net")  # fmt: skip
    yield case("numbers behind the document", f'{{"surface":{GOOD}}}\n\0\0\0\0\0\0\xf0?', 400,
               "malformed_json", "")  # fmt: skip
    yield long("blanks", lambda: b" " * (3 << 20), 400, "malformed_json", "")
    many = ",".join(f'"k{k}":1' for k in range(60_000))
    yield long("very many keys", lambda: options(many).encode(), 422, "too_many_strings", "")


STORES: tuple[Hostile, ...] = tuple(stores())
"""The same for POST /v1/surfaces."""
