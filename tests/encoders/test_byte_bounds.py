"""No file is longer than the bound that is computed from the size of its mesh."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from service.encoders.format import EncodeOptions, Format, OoglForm
from service.encoders.gltf import meshopt
from service.encoders.oogl import byte_bound
from service.encoders.oogl_patches import HIGHEST_DEGREE, encode_patches
from service.encoders.registry import FORMATS
from service.encoders.text import FLOAT32_CHARS, FLOAT64_CHARS, json_array
from service.engine.connectivity.closure import Closure
from service.engine.mesh.brep_report import BrepReport
from service.engine.mesh.mesh import Mesh
from service.engine.quantize import quantize_mesh
from service.engine.stored_positions import MIN_STEP
from service.errors import Issue, UnsupportedByFormat
from service.surface.batches import TensorPatches
from service.surface.brep_model import SkippedFace
from service.surface.lowered import Part, PatchModel
from tools.meshes import (
    Faces,
    add_attributes,
    add_overlays,
    build_brep,
    build_control_net,
    build_sheet,
    build_silo,
    measure_size,
    to_single,
)

MAX_FLOAT32 = float(np.finfo(np.float32).max)
FORMS: list[OoglForm | None] = [None, "cquad", "mesh", "off"]
COMPACT_OPTIONS: list[dict[str, Any]] = [
    {"quantize": quantize, "compression": compression}
    for quantize in (False, True)
    for compression in ("none", "meshopt")
    if compression == "none" or meshopt.is_available()
]
LONGEST_FLOAT64 = -1.2345678901234567e-305
"""A float64 whose text has the largest number of characters."""
LONGEST_FLOAT32 = np.float32(-1.1754944e-38)
"""A float32 whose text has the largest number of characters."""
LONGEST_BREP = BrepReport(
    *(False, -LONGEST_FLOAT64, 10**9, False, 10**9, 10**9, 10**9, 10**9, -LONGEST_FLOAT64),
    skipped_faces=(
        SkippedFace(10**5, Issue("edge_not_on_surface", "", "", *(2 * ["text of a refusal" * 5]))),
    ),
    unbounded_reason="x" * 80,
)
"""A report of a brep with the longest numbers and texts."""
LONGEST_NAME = "\x01" * 99
"""A name whose text in JSON has the largest number of characters for each byte: `\\u0001`."""

each_format = pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)


def measure_forms(
    fmt: Format, mesh: Mesh, compact_options: Sequence[dict[str, Any]] = COMPACT_OPTIONS
) -> list[tuple[int, int]]:
    """The length in bytes of the file, and the bound of this length, in each form of a format.

    Only OOGL has several forms. Formats that can quantize or compress are also tested with each of
    the `compact_options`. Forms that cannot store the mesh are skipped.
    """
    sizes = []
    all_options = [EncodeOptions(form) for form in (FORMS if fmt.name == "oogl" else [None])]
    all_options += [replace(all_options[0], **choice) for choice in compact_options if fmt.compact]
    for options in all_options:
        try:
            length = len(fmt.encode(move_to_grid(mesh) if options.quantize else mesh, options))
        except UnsupportedByFormat:
            continue
        sizes.append((length, fmt.byte_bound(measure_size(mesh), options)))
    return sizes


def move_to_grid(mesh: Mesh) -> Mesh:
    """The mesh with its positions on a grid as fine as 16 bits allow.

    `quantize_mesh` takes a larger step than `MIN_STEP` if the mesh needs it.
    """
    return quantize_mesh(mesh, MIN_STEP)


@pytest.mark.slow
@each_format
@settings(max_examples=12)
@given(data=st.data())
def test_files_with_any_positions_are_not_longer_than_the_bound(
    fmt: Format, data: st.DataObject
) -> None:
    faces: Faces = data.draw(st.sampled_from(["triangles", "quads"]))
    sides, rows = data.draw(st.integers(3, 6)), data.draw(st.integers(1, 3))
    is_brep = data.draw(st.booleans())
    mesh = build_brep(sides, rows) if is_brep else build_silo(sides, rows, faces)
    mesh = add_overlays(mesh) if data.draw(st.booleans()) else mesh
    mesh = add_attributes(mesh, data.draw(st.booleans())) if data.draw(st.booleans()) else mesh
    positions = data.draw(
        arrays.arrays(
            np.float64,
            mesh.positions.shape,
            elements=st.floats(-MAX_FLOAT32, MAX_FLOAT32, allow_nan=False),
        )
    )
    mesh = replace(mesh, name=data.draw(st.text(max_size=20)), positions=positions)
    for length, bound in measure_forms(fmt, mesh):
        assert length <= bound


@each_format
@pytest.mark.parametrize(
    "mesh",
    [build_sheet(20), build_silo(3, 1), build_brep(3, 1)],
    ids=["many vertices", "many parts", "brep"],
)
def test_files_with_the_longest_numbers_and_names_are_not_longer_than_the_bound(
    fmt: Format, mesh: Mesh
) -> None:
    positions = np.full_like(mesh.positions, LONGEST_FLOAT64)
    normals = np.full(mesh.positions.shape, LONGEST_FLOAT32)
    overlay = build_control_net()
    overlay = replace(
        overlay, positions=np.full_like(overlay.positions, LONGEST_FLOAT64), name=LONGEST_NAME
    )
    parts = tuple(
        replace(part, name=LONGEST_NAME, deviation_bound=-LONGEST_FLOAT64) for part in mesh.parts
    )
    report = replace(
        mesh.report,
        closure=Closure("C0", "C1"),
        deviation_bound=-LONGEST_FLOAT64,
        mesh_deviation_bound=-LONGEST_FLOAT64,
        normal_angle=-LONGEST_FLOAT64,
        brep=mesh.report.brep and LONGEST_BREP,
    )
    mesh = replace(mesh, positions=positions, normals=normals, parts=parts, name=LONGEST_NAME)
    mesh = replace(mesh, report=report)
    mesh = replace(mesh, overlays=(overlay,), origin=np.full(3, LONGEST_FLOAT64))
    # Names of attributes have at most 32 characters.
    attributes = tuple(
        (f"{columns:a<32}", np.full((len(positions), columns), float(LONGEST_FLOAT32)))
        for columns in (1, 2, 3, 4, 5, 16)
    )
    colors = np.full((len(positions), 4), -float(LONGEST_FLOAT32))
    for length, bound in measure_forms(fmt, mesh):
        assert length <= bound
    mesh = replace(mesh, colors=colors, attributes=attributes)
    for length, bound in measure_forms(fmt, mesh):
        assert length <= bound


@each_format
@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_the_bound_is_not_far_above_the_size(fmt: Format, faces: Faces) -> None:
    mesh = build_silo(48, 16, faces)
    assert mesh.normals is not None
    # A rotation gives the numbers of the silo, which are short, all their digits.
    rotation = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    mesh = replace(mesh, positions=mesh.positions @ rotation, normals=mesh.normals @ rotation)
    mesh_with_channels = add_attributes(mesh)
    mesh_with_channels = replace(
        mesh_with_channels,
        colors=mesh_with_channels.colors if "colors" in fmt.carries else None,
        attributes=mesh_with_channels.attributes if "attribute" in fmt.carries else (),
    )
    # 3MF compresses its text; the bound is that of the text.
    most = 12 if fmt.name == "3mf" else 3
    for each in (mesh, mesh_with_channels):
        for length, bound in measure_forms(fmt, to_single(each) if fmt.is_float32 else each, ()):
            assert length <= bound <= most * length


@pytest.mark.parametrize("degree", [1, 3, HIGHEST_DEGREE])
def test_files_of_patches_are_not_longer_than_the_bound(degree: int) -> None:
    points = np.full((3, degree + 1, degree + 1, 3), LONGEST_FLOAT64)
    batch = TensorPatches(points, np.full(points.shape[:3], 1 / 3))
    model = PatchModel("model", (batch,), (Part("model", 0, 3),))
    length = len(encode_patches(model, (build_control_net(),)))
    size = measure_size(add_overlays(build_sheet(1)))
    size = replace(size, patches=3, control_points=3 * (degree + 1) ** 2)
    # The bound has some hundred bytes for heads and overlays, which matter for short files.
    assert length <= byte_bound(size, EncodeOptions("bez")) <= 3 * length + 1024


def test_no_text_of_a_number_is_longer_than_the_constant() -> None:
    bits = np.random.default_rng(1).integers(0, 2**64, 200_000, dtype=np.uint64)
    for dtype, max_length in ((np.float64, FLOAT64_CHARS), (np.float32, FLOAT32_CHARS)):
        values = bits.view(dtype)
        values = values[np.isfinite(values)]
        # More numbers from 1e-9 to 1e19, where texts change to the notation with an exponent.
        normal = np.random.default_rng(2).standard_normal((2000, 1)) * 10.0 ** np.arange(-9, 20)
        numbers = np.concatenate([values, normal.astype(dtype).ravel()])
        assert max(map(len, json_array(numbers)[1:-1].split(b","))) <= max_length
