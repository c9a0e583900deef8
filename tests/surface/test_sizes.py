"""Every kind of surface has a size, which is exact or an upper bound for its lowered model."""

from abc import ABC
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import isabstract
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from service.api.openapi.parameters import REQUESTS
from service.bases.arrays import FloatArray
from service.schemas.kinds import KINDS
from service.schemas.request import MeshRequest
from service.surface.batches import TrianglePatches
from service.surface.curve_model import SweepModel
from service.surface.exact_tubes import ExactPatches
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.lowered import GroupModel, Model, PatchModel, SingleModel
from service.surface.sizes import NetSurface, SurfaceKind
from service.surface.sweeps import SweptSurface

SERVICE = Path(__file__).parents[2] / "service"

MESH_REQUESTS = REQUESTS["createMesh"]
"""Examples of requests by name; every kind of surface has one."""

SMALL = 256
"""Bytes of computed control points that `size` need not count: a net of fixed size is no matter for
limits."""


def test_every_kind_has_methods_for_its_size_and_its_lowering() -> None:
    kinds = get_args(Surface)
    assert len(kinds) > 6
    for kind in kinds:
        assert issubclass(kind, SurfaceKind)
        assert not isabstract(kind)


def test_surfaces_of_a_class_without_size_cannot_be_created() -> None:
    assert issubclass(SurfaceKind, ABC)
    class_without_size = type("Silent", (SurfaceKind,), {"lower": lambda _: None})
    with pytest.raises(TypeError, match="size"):
        class_without_size()


def list_models(model: Model) -> list[SingleModel]:
    """The models of all members of a group, or the only model."""
    if isinstance(model, GroupModel):
        return [model.models[member.model] for member in model.members]
    return [model]


@pytest.mark.parametrize("example", EXAMPLES)
def test_sizes_agree_with_the_lowered_model(example: str) -> None:
    surface = find(example).surface()
    size, models = surface.size(), list_models(surface.lower())
    batches = [b for each in models if isinstance(each, PatchModel) for b in each.batches]
    triangle_counts = [batch.count for batch in batches if isinstance(batch, TrianglePatches)]
    assert size.patches == sum(batch.count for batch in batches)
    assert size.triangles == sum(triangle_counts)
    assert size.control_points >= sum(batch.points.size // 3 for batch in batches)
    assert size.members == len(models)
    assert size.curves == sum(each.pieces.count for each in models if isinstance(each, SweepModel))
    # The control nets that a mesh may show.
    net_points = [
        net.points.size // 3 for each in models if isinstance(each, PatchModel) for net in each.nets
    ]
    assert size.net_points >= sum(net_points)
    parts = [part.name for each in models if isinstance(each, PatchModel) for part in each.parts]
    assert size.parts >= len(parts)
    assert size.name_bytes >= sum(len(name.encode()) for name in parts)
    for batch in batches:
        assert max(batch.side_degrees) <= max(size.degree)
        # Of the channels, `size` counts colors, uvs and only the attributes that all members of a
        # group have; `stored_size` has room for the attributes of each member.
        width = sum(channel.dimension for channel in batch.channels)
        assert width <= surface.stored_size().width
    if not isinstance(surface, GroupSurface):
        assert surface.stored_size() == size


def find_arrays(value: object) -> Iterator[FloatArray]:
    """All arrays in a value: those of its attributes and of its items, too."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from find_arrays(item)
    elif is_dataclass(value):
        for field in fields(value):
            yield from find_arrays(getattr(value, field.name))


@pytest.mark.parametrize("name", [*EXAMPLES, *MESH_REQUESTS])
def test_sizes_include_the_control_points_that_lowering_computes(name: str) -> None:
    if name in EXAMPLES:
        surface = find(name).surface()
    else:
        surface = MeshRequest.model_validate(MESH_REQUESTS[name]["value"]).to_surface()
    if isinstance(surface, GroupSurface):
        surfaces: list[SurfaceKind] = [each.surface for each in surface.members if each.surface]
    else:
        surfaces = [surface]
    for each in surfaces:
        model, own_arrays = each.lower(), [*find_arrays(each)]
        computed_bytes = sum(
            array.nbytes
            for batch in (model.batches if isinstance(model, PatchModel) else ())
            for array in find_arrays((batch.points, batch.weights, batch.channels))
            if not any(np.may_share_memory(array, other) for other in own_arrays)
        )
        size = each.size()
        counted_bytes = min(size.lowered_bytes, size.peak_bytes)
        hint = "set `lowered_bytes` and `peak_bytes` in `size` (service/surface/sizes.py)"
        assert computed_bytes <= counted_bytes + SMALL, hint


def test_every_kind_is_listed_in_service_surface_and_in_service_schemas() -> None:
    def list_classes(room: str) -> Iterator[Any]:
        for file in (SERVICE / room).glob("[a-z]*.py"):
            module = import_module(f"service.{room}.{file.stem}")
            yield from (c for c in vars(module).values() if isinstance(c, type))

    # Bases of several kinds are no kinds, and no request has what a tube is equal to.
    bases = {SurfaceKind, NetSurface, SweptSurface, ExactPatches}
    classes = {c for c in list_classes("surface") if issubclass(c, SurfaceKind)}
    kinds = {c for c in classes - bases if not c.__name__.startswith("_")}
    assert kinds == {*get_args(Surface)}, "list the kind in service/surface/kinds.py"
    models = [c for c in list_classes("schemas") if hasattr(c, "to_surface")]
    types = [c.model_fields["type"] for c in models if "type" in c.model_fields]
    names = {name for field in types for name in get_args(field.annotation)}
    assert names == {*KINDS}, "list the kind in service/schemas/kinds.py"
