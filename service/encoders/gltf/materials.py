"""Materials of surfaces and lines in glTF.

References
----------
Khronos, glTF 2.0 Specification: 3.9 materials. KHR_materials_unlit.
"""

import numpy as np

from service.encoders.gltf.buffer import JsonObject
from service.engine.scenes.colors import to_linear
from service.surface.lowered import Color

UNLIT = "KHR_materials_unlit"
"""The extension for materials without shading."""

SURFACE_MATERIAL: JsonObject = {
    "name": "surface",
    "doubleSided": True,
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.6, 0.62, 0.66, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.5,
    },
}
"""The grey material of faces without colours."""

COLORED_MATERIAL: JsonObject = {
    "name": "surface",
    "doubleSided": True,
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
}
"""The material of faces with vertex colours. Its base colour is white, the default, which does not
change the colours of the vertices."""

LINE_MATERIAL: JsonObject = {
    "name": "lines",
    "extensions": {UNLIT: {}},
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.85, 0.25, 0.05, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.9,
    },
}
"""The orange material of lines."""


def surface_material(
    color: Color | None, *, is_colored: bool, is_blended: bool = False
) -> JsonObject:
    """The material of faces.

    Parameters
    ----------
    color : Color or None
        The base colour, by which the colours of vertices are multiplied. The name of the material
        contains it. Without it, faces are grey, or white if vertices have colours.
    is_colored : bool
        Whether vertices have colours.
    is_blended : bool
        Whether any vertex is translucent.
    """
    material = COLORED_MATERIAL if is_colored else SURFACE_MATERIAL
    if color is not None:
        code = "".join(f"{round(255 * value):02x}" for value in color[: 4 if color[3] < 1 else 3])
        (factor,) = to_linear(np.array([color])).tolist()
        shade = material["pbrMetallicRoughness"] | {"baseColorFactor": factor}
        name = f"{material['name']} #{code}"
        material = material | {"name": name, "pbrMetallicRoughness": shade}
        is_blended = is_blended or color[3] < 1
    return material | ({"alphaMode": "BLEND"} if is_blended else {})
