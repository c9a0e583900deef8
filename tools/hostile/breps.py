"""Hostile breps, each with the error that it must get."""

from collections.abc import Iterator

from tools.hostile.requests import (
    NOT_NUMBERS,
    NOT_TO_REPEAT,
    HostileBody,
    build_case,
    build_long_case,
    repeat_word,
    vary_body,
    write_many_keys,
    write_surface,
)

VERTICES = "[[0,0,0],[10,0,0],[10,10,0],[0,10,0],[2,2,0],[4,2,0],[3,5,0]]"
EDGES = (
    '{"vertices":[0,1]},{"vertices":[1,2]},{"vertices":[2,3]},{"vertices":[3,0]},'
    '{"vertices":[4,5]},{"vertices":[5,6]},{"vertices":[6,4]}'
)
NET = '{"control_net":[[[0,0,0],[0,10,0]],[[10,0,0],[10,10,0]]]}'
LOOPS = '{"edges":[0,1,2,3]},{"edges":[6,5,4],"reversed":[true,true,true]}'
FACE = f'{{"surface":{NET},"loops":[{LOOPS}]}}'
"""A square with a hole that is a triangle: its vertices, edges, surface, loops, and the face."""


def write_brep(
    fields: str = "", vertices: str = VERTICES, edges: str = EDGES, faces: str = FACE
) -> str:
    """The JSON text of a request with a brep; `fields` follow the others."""
    return write_surface(
        f'"type":"brep","vertices":{vertices},"edges":[{edges}],"faces":[{faces}]{fields}'
    )


def write_face(fields: str) -> str:
    """A request with a brep of one face, with these fields beside its surface."""
    return write_brep(faces=f'{{"surface":{NET},{fields}}}')


def write_loops(text: str) -> str:
    """A request with a brep of one face with these loops."""
    return write_face(f'"loops":{text}')


def build_brep_cases() -> Iterator[HostileBody]:
    """Breps with invalid fields, and breps that do not fit together."""
    yield from vary_body(
        "vertex", write_brep(vertices="[[0,0,0],[1,0,?]]"), "/surface/vertices/1/2", NOT_NUMBERS
    )
    faults = {
        "null_value": "null",
        "wrong_type": f'1 "{NOT_TO_REPEAT}" {{}}',
        "wrong_dimension": "[[0,0]]@/0 [[0,0,0],[0,0,0,1]]@/1",
        "coordinate_too_large": "[[0,0,1e39]]@/0/2",
    }
    yield from vary_body("vertices", write_brep(vertices="?"), "/surface/vertices", faults)
    yield from _build_edge_cases()
    yield from _build_face_cases()
    yield from _build_loop_cases()
    faults = {
        "wrong_length": ',"vertex_uncertainties":[1]@vertex_uncertainties ,"shells":[]@shells',
        "out_of_range": ',"uncertainty":-1@uncertainty ,"vertex_uncertainties":'
        "[0,0,0,-1,0,0,0]@vertex_uncertainties/3",
        "not_finite": ',"uncertainty":1e999@uncertainty',
        "wrong_value": ',"invalid_faces":"repair"@invalid_faces ,"up":"x"@up',
        "unknown_field": f',"{NOT_TO_REPEAT}":1@{NOT_TO_REPEAT} ,"control_net":[]@control_net',
        "empty_list": ',"shells":[{"faces":[]}]@shells/0/faces',
        "unknown_face": ',"shells":[{"faces":[1]}]@shells/0/faces/0'
        ' ,"shells":[{"faces":[0,-1]}]@shells/0/faces/1',
        "repeated_face": ',"shells":[{"faces":[0]},{"faces":[0]}]@shells/1/faces/0',
        "not_closed": ',"shells":[{"faces":[0],"closed":true}]@shells/0',
        "wrong_type": ',"shells":[{"faces":[0],"closed":1}]@shells/0/closed'
        ' ,"shells":[{"faces":[true]}]@shells/0/faces/0',
    }
    yield from vary_body("field", write_brep("?"), "/surface/", faults)
    yield build_case(
        "no shell of a face",
        write_brep(',"shells":[{"faces":[1]}]', faces=f"{FACE},{FACE}"),
        "missing_face",
        "/surface/shells",
    )
    yield build_case("no faces", write_brep(faces=""), "wrong_length", "/surface/faces")
    twice = f'{FACE},{FACE[:-1]},"reversed":false}}'
    code = "used_twice_same_direction"
    yield build_case("a face twice", write_brep(faces=twice), code, "/surface/edges/0")
    group = f'{{"surface":{{"type":"group","members":[{{"surface":{write_brep()[11:-1]}}},?]}}}}'
    faults = {"wrong_length": '{"surface":{"type":"brep","faces":[]}}'}
    yield from vary_body("member", group, "/surface/members/1/surface/faces", faults)
    yield from _build_long_cases()


def _build_edge_cases() -> Iterator[HostileBody]:
    faults = {
        "missing_field": "{}@/vertices",
        "null_value": 'null {"vertices":null}@/vertices {"vertices":[0,null]}@/vertices/1'
        ' {"vertices":[0,1],"curve":null}@/curve',
        "wrong_type": f'[] "{NOT_TO_REPEAT}" {{"vertices":1}}@/vertices'
        ' {"vertices":[0,true]}@/vertices/1 {"vertices":[0,1.0]}@/vertices/1'
        ' {"vertices":[0,1],"degenerate":1}@/degenerate',
        "wrong_length": '{"vertices":[]}@/vertices {"vertices":[0]}@/vertices'
        ' {"vertices":[0,1,2]}@/vertices {"vertices":[0,1],"degenerate":true}@/vertices',
        "unknown_vertex": '{"vertices":[0,7]}@/vertices {"vertices":[-1,1]}@/vertices'
        ' {"vertices":[0,9007199254740992]}@/vertices',
        "index_out_of_range": '{"vertices":[0,18446744073709551615]}@/vertices/1',
        "degenerate_curve": '{"vertices":[0,0]}'
        ' {"vertices":[0,1],"curve":{"control_points":[[0,0,0],[0,0,0]]}}@/curve/control_points',
        "conflicting_options": '{"vertices":[0],"degenerate":true,"curve":'
        '{"control_points":[[0,0,0],[10,0,0]]}}@/curve',
        "out_of_range": '{"vertices":[0,1],"uncertainty":-1}@/uncertainty',
        "unknown_field": f'{{"vertices":[0,1],"{NOT_TO_REPEAT}":1}}@/{NOT_TO_REPEAT}',
        "unknown_type": '{"vertices":[0,1],"curve":{"type":"line"}}@/curve/type',
        "wrong_dimension": '{"vertices":[0,1],"curve":{"control_points":[[0,0],[10,0]]}}'
        "@/curve/control_points",
        "edge_not_at_vertex": '{"vertices":[0,1],"curve":{"control_points":[[5,5,5],[10,0,0]]}}'
        '@/vertices {"vertices":[0,1],"curve":{"control_points":[[0,0,0],[1e30,0,0]]}}@/vertices',
        "knot_multiplicity": '{"vertices":[0,1],"curve":{"type":"bspline","degree":1,'
        '"control_points":[[0,0,0],[1,0,0],[2,0,0],[10,0,0]],"knots":[0,0,1,1,2,2]}}@/curve/knots/3',
        "knots_decrease": '{"vertices":[0,1],"curve":{"type":"bspline","degree":1,'
        '"control_points":[[0,0,0],[10,0,0]],"knots":[0,0,1,-1]}}@/curve/knots/3',
        "empty_domain": '{"vertices":[0,1],"curve":{"type":"bspline","degree":1,'
        '"control_points":[[0,0,0],[10,0,0]],"knots":[0,1,1,2]}}@/curve/knots',
        "weight_ratio": '{"vertices":[0,1],"curve":{"weights":[1,1e9],'
        '"control_points":[[0,0,0],[10,0,0]]}}@/curve/weights',
    }
    body = write_brep(edges="?," + EDGES.partition("},")[2])
    yield from vary_body("edge", body, "/surface/edges/0", faults)
    coordinate = '{"vertices":[0,1],"curve":{"control_points":[[0,0,0],[10,?,0]]}}'
    pointer = "/surface/edges/0/curve/control_points/1/1"
    body = write_brep(edges=f"{coordinate},{EDGES.partition('},')[2]}")
    yield from vary_body("curve", body, pointer, NOT_NUMBERS)


def _build_face_cases() -> Iterator[HostileBody]:
    faults = {
        "missing_field": "{}@/surface",
        "null_value": f'null {{"surface":null}}@/surface {{"loops":null,"surface":{NET}}}@/loops'
        f' {{"name":null,"surface":{NET}}}@/name {{"color":null,"surface":{NET}}}@/color',
        "wrong_type": f'[] 1 {{"surface":[]}}@/surface {{"loops":{{}},"surface":{NET}}}@/loops'
        f' {{"reversed":"true","surface":{NET}}}@/reversed',
        "wrong_length": f'{{"name":"","surface":{NET}}}@/name'
        f' {{"color":[1,1],"surface":{NET}}}@/color',
        "out_of_range": f'{{"color":[1,1,2],"surface":{NET}}}@/color/2',
        "wrong_value": f'{{"name":"a\\u0000","surface":{NET}}}@/name',
        "unknown_type": '{"surface":{"type":"patches"}}@/surface/type',
        "unknown_field": f'{{"{NOT_TO_REPEAT}":1,"surface":{NET}}}@/{NOT_TO_REPEAT} '
        + " ".join(
            f'{{"surface":{{"{name}":"{NOT_TO_REPEAT}",{NET[1:]}}}@/surface/{name}'
            for name in ("up", "name", "colors", "uvs", "attributes")
        ),
        "knot_multiplicity": '{"surface":{"type":"bspline","degree":1,"control_net":'
        "[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]],[[2,0,0],[2,1,0]],[[3,0,0],[3,1,0]]],"
        '"knots":[[0,0,1,1,2,2],"clamped"]}}@/surface/knots/0',
        "too_few_points": '{"surface":{"control_net":[[[0,0,0]]]}}@/surface/control_net',
    }
    yield from vary_body("face", write_brep(faces="?"), "/surface/faces/0", faults)
    net = '{"surface":{"control_net":[[[0,0,0],[0,?,0]],[[1,0,0],[1,1,0]]]}}'
    pointer = "/surface/faces/0/surface/control_net/0/1/1"
    yield from vary_body("net of a face", write_brep(faces=net), pointer, NOT_NUMBERS)


def _build_loop_cases() -> Iterator[HostileBody]:
    faults = {
        "missing_field": "[{}]@/0/edges",
        "null_value": '[null]@/0 [{"edges":null}]@/0/edges [{"pcurves":[null]}]@/0/pcurves/0',
        "wrong_type": '[1]@/0 [{"edges":1}]@/0/edges [{"edges":[0,1.0,2,3]}]@/0/edges/1'
        ' [{"edges":[0,1,2,3],"reversed":[0,0,0,0]}]@/0/reversed/0',
        "wrong_length": '[{"edges":[]}]@/0/edges'
        ' [{"edges":[0,1,2,3],"reversed":[true]}]@/0/reversed'
        ' [{"edges":[0,1,2,3],"pcurves":[null]}]@/0/pcurves',
        "unknown_edge": '[{"edges":[0,1,2,7]}]@/0/edges/3 [{"edges":[0,1,2,-1]}]@/0/edges/3',
        "index_out_of_range": '[{"edges":[18446744073709551615]}]@/0/edges/0',
        "loop_open": '[{"edges":[0,1,2]}]@/0 [{"edges":[0,1,2,3]},{"edges":[4]}]@/1'
        ' [{"edges":[0,1,2,3],"reversed":[true,false,false,false]}]@/0',
        "unknown_field": f'[{{"edges":[0,1,2,3],"{NOT_TO_REPEAT}":1}}]@/0/{NOT_TO_REPEAT}',
        "wrong_dimension": '[{"pcurves":[{"control_points":[[0,0,0],[1,1,1]]}]}]'
        "@/0/pcurves/0/control_points",
        "too_few_points": '[{"pcurves":[{"control_points":[[0,0]]}]}]@/0/pcurves/0/control_points',
        "unknown_type": '[{"pcurves":[{"type":"circle"}]}]@/0/pcurves/0/type',
    }
    yield from vary_body("loops", write_loops("?"), "/surface/faces/0/loops", faults)


def _build_long_cases() -> Iterator[HostileBody]:
    """Breps with very many faces, edges or keys."""
    face, edge = f'{{"surface":{NET}}}', '{"vertices":[0,1]}'

    def write_faces(count: int, last: str = face) -> str:
        return write_surface(f'"type":"brep","faces":[{f"{face}," * count}{last}]')

    def write_edges(count: int, last: str) -> str:
        return write_brep(edges=f"{EDGES},{f'{edge},' * count}{last}")

    pointer = "/surface/faces"
    yield build_long_case("faces", lambda: write_faces(20_000), "too_many_faces", pointer)
    yield build_long_case(
        "a face behind many",
        lambda: write_faces(5000, "{}"),
        "missing_field",
        f"{pointer}/5000/surface",
    )
    pointer = "/surface/edges/30007/vertices"
    yield build_long_case(
        "an edge behind many", lambda: write_edges(30_000, "{}"), "missing_field", pointer
    )
    unknown = write_many_keys(40_000, "}")
    yield build_long_case(
        "unknown keys of a face",
        lambda: write_faces(1, unknown),
        "missing_field",
        "/surface/faces/1/surface",
    )
    yield build_long_case(
        "unknown keys of many faces",
        lambda: write_surface(f'"type":"brep","faces":[{repeat_word(unknown, 3)[1:-1]}]'),
        "too_many_strings",
    )
    numbers = repeat_word("0", 150_000)
    pointer = "/surface/faces/0/loops/0"
    yield build_long_case(
        "edges of a loop", lambda: write_loops(f'[{{"edges":{numbers}}}]'), "loop_open", pointer
    )
    yield build_long_case(
        "loops", lambda: write_loops(repeat_word("{}", 50_000)), "missing_field", f"{pointer}/edges"
    )


def build_brep_conversions() -> Iterator[HostileBody]:
    """Requests to /v1/convert with invalid operations on breps."""
    brep = write_brep()[:-1]
    faults = {
        "missing_field": '{"op":"untrim"}@/face {"op":"select"}@/faces',
        "null_value": '{"op":"untrim","face":null}@/face {"op":"select","faces":[null]}@/faces/0',
        "wrong_type": '{"op":"untrim","face":"0"}@/face {"op":"select","faces":0}@/faces',
        "wrong_length": '{"op":"select","faces":[]}@/faces',
        "out_of_range": '{"op":"untrim","face":-1}@/face',
        "unknown_face": '{"op":"untrim","face":1}@/face {"op":"select","faces":[0,7]}@/faces/1'
        ' {"op":"untrim","patch":1}@/patch {"op":"untrim","face":18446744073709551615}@/face'
        ' {"op":"select","faces":[18446744073709551615]}@/faces/0',
        "repeated_face": '{"op":"select","faces":[0,0]}@/faces/1',
        "conflicting_options": '{"op":"untrim","face":0,"patch":0}@/patch'
        ' {"op":"untrim","member":0,"patch":0}@/patch',
        "unknown_field": '{"op":"untrim","face":0,"member":0}@/member',
        "not_parametric": '{"op":"elevate","degree":3} {"op":"bezier"} {"op":"transpose"}',
    }
    body = f'{brep},"operations":[?]}}'
    yield from vary_body("faces", body, "/operations/0", faults)
    many = repeat_word("0", 300_000)
    yield build_long_case(
        "faces",
        lambda: body.replace("?", f'{{"op":"select","faces":{many}}}'),
        "repeated_face",
        "/operations/0/faces/1",
    )


BREPS: tuple[HostileBody, ...] = tuple(build_brep_cases())
"""Breps for POST /v1/mesh."""
