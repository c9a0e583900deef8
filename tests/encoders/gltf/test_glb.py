"""GLB files: a plan caches the text of its files; the bytes do not depend on this cache."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from service.encoders.format import EncodeOptions, SplitContent
from service.encoders.gltf.glb import PLACEHOLDER, encode_glb
from service.engine.build import build
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.surface.examples.catalogue import EXAMPLES
from tools.examples import UNTRIMMED

OPTIONS = EncodeOptions()


def build_example(name: str, resolution: int = 4) -> Mesh:
    """A mesh of an example, with the faces of a cached plan; the encoder caches a text for them."""
    options = MeshOptions((resolution, resolution), uvs=True)
    return build(EXAMPLES[name].surface().lower(), options, is_float32=True)


def encode(mesh: Mesh) -> bytes:
    return bytes(encode_glb(mesh, OPTIONS))


def encode_without_plan(mesh: Mesh) -> bytes:
    """The file of the mesh with a copy of its faces, for which the encoder has no cached text."""
    return encode(replace(mesh, triangles=mesh.triangles.copy()))


@pytest.mark.parametrize("name", UNTRIMMED)
def test_files_with_cached_text_are_equal(name: str) -> None:
    mesh = build_example(name)
    assert encode(mesh) == encode(mesh) == encode_without_plan(mesh)


def test_the_cached_text_has_no_values_of_another_mesh() -> None:
    """A file has the positions, names, colours and so on of its own mesh, whatever is cached."""
    mesh = build_example("utah-teapot")
    encode(mesh)
    parts = tuple(replace(part, name=f"{part.name} é", deviation_bound=None) for part in mesh.parts)
    red_parts = tuple(replace(part, color=(1.0, 0.0, 0.0, 0.5)) for part in mesh.parts)
    changed_meshes = (
        replace(mesh, positions=2 * mesh.positions),
        replace(mesh, origin=np.array([1e6, 0, 0.5])),
        replace(mesh, name="teapot", parts=parts),
        replace(mesh, parts=red_parts, up="y"),
        replace(mesh, normals=None),
        replace(mesh, colors=np.full((len(mesh.positions), 4), 0.5, np.float32)),
        replace(mesh, report=replace(mesh.report, watertight=False, boundary_edges=7)),
    )
    for changed in changed_meshes:
        assert encode(changed) == encode(changed) == encode_without_plan(changed)


@pytest.mark.parametrize("key", ["report", "origin", "low0", "high7"])
def test_a_name_may_be_equal_to_a_placeholder_of_the_cached_text(key: str) -> None:
    """A placeholder stands for a value; `low0` and `high7` for bounds of the parts 0 and 7."""
    mesh = replace(build_example("saddle"), name=PLACEHOLDER.format(key))
    assert encode(mesh) == encode(mesh) == encode_without_plan(mesh)


def test_a_long_file_has_several_buffers_some_of_which_are_arrays_of_the_mesh() -> None:
    mesh = build_example("saddle", 128)
    content = encode_glb(mesh, OPTIONS)
    assert isinstance(content, SplitContent)
    assert len(content) == len(bytes(content))
    assert bytes(content) == encode(mesh) == encode_without_plan(mesh)
    assert any(
        np.shares_memory(np.frombuffer(buffer, np.uint8), mesh.positions)
        for buffer in content
        if buffer
    )


# `sizes` are the lengths of the buffers; buffers of more than ten bytes stay as they are.
@pytest.mark.parametrize("sizes", [(), (0,), (3, 4, 5), (11, 1, 9, 1), (4, 20, 3, 3, 3, 3)])
def test_short_neighbours_are_joined_up_to_ten_bytes(sizes: tuple[int, ...]) -> None:
    content = SplitContent(tuple(bytes([number]) * size for number, size in enumerate(sizes)))
    joined = list(content.join_short(10))
    assert b"".join(joined) == bytes(content)
    assert all(len(buffer) <= 10 or buffer in content.buffers for buffer in joined)
    assert all(len(first) + len(second) > 10 for first, second in pairwise(joined))
