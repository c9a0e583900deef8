"""A plain service for meshes, written in one hour, to compare the service with.

It uses FastAPI, typed lists and NumPy; it does not handle seams and poles, and computes no bounds.
"""

import json
import struct
from functools import cache
from typing import Any

import numpy as np
from fastapi import FastAPI, Response
from pydantic import BaseModel
from scipy.interpolate import BSpline


class Surface(BaseModel):
    degree: int = 0
    control_net: list[list[tuple[float, float, float]]] | None = None
    vertices: list[tuple[float, float, float]] | None = None
    patches: list[list[list[int]]] | None = None


class MeshRequest(BaseModel):
    surface: Surface
    resolution: int


@cache
def sample_basis(count: int, p: int, resolution: int) -> tuple[Any, Any]:
    """Values and derivatives of `count` clamped B-splines of degree p at all samples.

    If p is 0, they are those of the Bernstein basis.
    """
    knots = np.pad(np.arange(count - (p or count - 1) + 1.0), p or count - 1, mode="edge")
    spline = BSpline(knots, np.eye(count), p or count - 1)
    t = np.linspace(0, knots[-1], int(knots[-1]) * resolution + 1)
    return spline(t), spline.derivative()(t)


def write_glb(arrays: list[Any]) -> bytes:
    ends = np.cumsum([each.nbytes for each in arrays]).tolist()
    kinds = {"componentType": 5126, "type": "VEC3"}, {"componentType": 5125, "type": "SCALAR"}
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}
    document: dict[str, Any] = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": ends[2]}]}
    document |= {"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "accessors": []}
    document |= {"meshes": [{"primitives": [primitive]}], "bufferViews": []}
    for k, each in enumerate(arrays):
        size = {"min": each.min(0).tolist(), "max": each.max(0).tolist()} if k < 2 else {}
        document["accessors"].append({"bufferView": k, "count": len(each)} | kinds[k // 2] | size)
        view = {"buffer": 0, "byteOffset": ends[k] - each.nbytes, "byteLength": each.nbytes}
        document["bufferViews"].append(view)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + ends[2], len(text), b"JSON")
    return head + text + struct.pack("<I4s", ends[2], b"BIN") + b"".join(map(bytes, arrays))


def build_mesh(suffix: str, request: MeshRequest) -> Any:
    surface, r = request.surface, request.resolution
    nets = np.array([surface.control_net] if surface.control_net else surface.vertices)
    nets = nets if surface.control_net else nets[np.array(surface.patches)]
    (u, du), (v, dv) = (sample_basis(n, surface.degree, r) for n in nets.shape[1:3])
    points, x, y = (np.einsum("ai,pijc,bj->pabc", a, nets, b, optimize=True).reshape(-1, 3)
                    for a, b in ((u, v), (du, v), (u, dv)))  # fmt: skip
    normals = np.cross(x, y)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    k = np.arange(len(points)).reshape(len(nets), len(u), len(v))
    a, b, c, d = k[:, :-1, :-1], k[:, 1:, :-1], k[:, 1:, 1:], k[:, :-1, 1:]
    faces = np.stack([a, b, d, b, c, d], axis=-1)
    if suffix == "json":
        return {
            "vertices": points.tolist(),
            "normals": normals.tolist(),
            "faces": faces.reshape(-1, 3).tolist(),
        }
    arrays = [points.astype("<f4"), normals.astype("<f4"), faces.astype("<u4").ravel()]
    return Response(write_glb(arrays), media_type="model/gltf-binary")


def create() -> FastAPI:
    app = FastAPI()
    app.post("/mesh.{suffix}")(build_mesh)
    return app
