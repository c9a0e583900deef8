"""Hooks for schemathesis: random files and jobs as lines, events of jobs, and responses in glTF.

This module runs in a Python of its own, in which neither the service nor NumPy is installed.
"""

import json
import struct
from collections.abc import Callable
from typing import Any

import schemathesis
from hypothesis import strategies as st

_coordinate = st.floats(-1e3, 1e3, width=32)
_points_on_side = st.integers(2, 5)


@st.composite
def _arrays(draw: Callable[..., Any]) -> bytes:
    """Files of one control net or of several, in the format of `numpy.save`."""
    patches = draw(st.sampled_from([(), (1,), (3,)]))
    shape = (*patches, draw(_points_on_side), draw(_points_on_side), 3)
    order, kind = draw(st.sampled_from("<>")), draw(st.sampled_from("fd"))
    size = {"f": 4, "d": 8}[kind]
    description = f"{{'descr': '{order}f{size}', 'fortran_order': False, 'shape': {shape}, }}"
    # With the 10 bytes before it, the header has 128 bytes: a multiple of 64, as NumPy requires.
    head = description.ljust(117) + "\n"
    patch_count = patches[0] if patches else 1
    count = shape[-3] * shape[-2] * 3 * patch_count
    values = draw(st.lists(_coordinate, min_size=count, max_size=count))
    return (
        b"\x93NUMPY\x01\x00"
        + struct.pack("<H", len(head))
        + head.encode()
        + struct.pack(f"{order}{count}{kind}", *values)
    )


@st.composite
def _oogl(draw: Callable[..., Any]) -> bytes:
    """Files of Bézier patches of one degree, in the format of Geomview."""
    p, q = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    count = 3 * (p + 1) * (q + 1) * draw(st.integers(1, 2))
    values = draw(st.lists(_coordinate, min_size=count, max_size=count))
    return f"BEZ{p}{q}3\n{' '.join(map(repr, values))}\n".encode()


@st.composite
def _teapots(draw: Callable[..., Any]) -> bytes:
    """Files of patches over shared vertices, in the layout of the Utah teapot."""
    side, patches, vertices = (
        draw(_points_on_side),
        draw(st.integers(1, 3)),
        draw(st.integers(1, 20)),
    )
    indices = st.lists(st.integers(1, vertices), min_size=side * side, max_size=side * side)
    lines = [str(patches), *(",".join(map(str, draw(indices))) for _ in range(patches))]
    lines.append(str(vertices))
    lines += [",".join(repr(draw(_coordinate)) for _ in range(3)) for _ in range(vertices)]
    return "\n".join((*lines, "")).encode()


@st.composite
def _wavefront(draw: Callable[..., Any]) -> bytes:
    """Files of one bilinear patch, as OBJ."""
    lines = [f"v {' '.join(repr(draw(_coordinate)) for _ in range(3))}" for _ in range(4)]
    lines += ["cstype bezier", "deg 1 1", "surf 0 1 0 1 1 2 3 4", "parm u 0 1", "parm v 0 1"]
    return "\n".join((*lines, "end", "")).encode()


@st.composite
def _geomdl(draw: Callable[..., Any]) -> bytes:
    """Files of one bilinear patch, as geomdl writes them."""
    points = [[draw(_coordinate) for _ in range(3)] for _ in range(4)]
    surface: dict[str, Any] = {"control_points": {"points": points}}
    for direction in "uv":
        surface |= {f"degree_{direction}": 1, f"size_{direction}": 2}
        surface[f"knotvector_{direction}"] = [0, 0, 1, 1]
    return json.dumps({"shape": {"type": "surface", "data": [surface]}}).encode()


@st.composite
def _lines_of_parts(draw: Callable[..., Any]) -> bytes:
    """Jobs as lines of JSON: small meshes by URL, and points of a random patch."""
    net = [[[draw(_coordinate) for _ in range(3)] for _ in range(2)] for _ in range(2)]
    mesh = {"path": f"/v1/surfaces/saddle/mesh.glb?resolution={draw(st.integers(1, 4))}"}
    points = {"path": "/v1/points", "body": {"surface": {"control_net": net}, "uv": [[0.5, 0.5]]}}
    parts = draw(st.lists(st.sampled_from([mesh, points]), min_size=1, max_size=3))
    return "".join(f"{json.dumps(part)}\n" for part in parts).encode()


schemathesis.openapi.media_type("application/x-ndjson", _lines_of_parts())
schemathesis.openapi.media_type("application/x-npy", _arrays())
schemathesis.openapi.media_type("model/x-oogl", _oogl())
schemathesis.openapi.media_type("text/x-teapot", _teapots())
schemathesis.openapi.media_type("model/obj", _wavefront())
schemathesis.openapi.media_type("application/vnd.geomdl+json", _geomdl())


@schemathesis.hook  # type: ignore[untyped-decorator]
def before_load_schema(_: Any, document: dict[str, Any]) -> None:
    """Changes the OpenAPI document to a form with the same meaning that schemathesis can read."""
    # Without `itemSchema`, schemathesis would take the schema of the whole stream for that of each
    # event.
    events = document["paths"].get("/v1/jobs/{id}/events", {}).get("get")
    if events is not None:
        events["responses"]["200"]["content"]["text/event-stream"] = {"itemSchema": _EVENT}
    for operations in document["paths"].values():
        for operation in operations.values():
            content = operation.get("requestBody", {}).get("content", {})
            for media_type in _TEXTS & set(content):
                # Strategies for these media types generate bytes, so examples must be bytes, too.
                for example in content[media_type].get("examples", {}).values():
                    example["value"] = example["value"].encode()


_TEXTS = {
    "application/vnd.geomdl+json",
    "application/x-ndjson",
    "model/obj",
    "model/x-oogl",
    "text/x-teapot",
}

_EVENT = {
    "type": "object",
    "required": ["event", "data", "retry"],
    "properties": {
        "event": {"enum": ["progress", "end"]},
        "data": {
            "type": "string",
            "contentMediaType": "application/json",
            "contentSchema": {"$ref": "#/components/schemas/Job"},
        },
        "retry": {"const": 1000},
    },
}
"""The events of a job: the state of the job as JSON."""


@schemathesis.deserializer("model/gltf+json")  # type: ignore[untyped-decorator]
def _gltf(_: Any, response: Any) -> Any:
    return json.loads(response.content)
