"""Multipatch surfaces of several patches and splines: seams, parts, parameters and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.engine.points.evaluate import evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.errors import InvalidRequest
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.channels import Channels
from service.surface.convert.operations import Elevate, Reverse, Split, Transpose
from service.surface.convert.table import convert
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.member import Member
from service.surface.multipatch import MAX_SURFACES, MultipatchSurface, Single
from service.surface.patches import PatchSurface
from tools.building import build

OPTIONS = (
    MeshOptions(resolution=(4, 4)),
    MeshOptions(resolution=(2, 3), faces="quads"),
    MeshOptions(accuracy=Accuracy(relative_tolerance=0.01)),
)


def list_single_surfaces(surface: object) -> tuple[Single, ...]:
    """The members of a group, or the patches of a surface, as separate surfaces."""
    if isinstance(surface, GroupSurface):
        return tuple(m.surface for m in surface.members)  # type: ignore[misc]
    assert isinstance(surface, PatchSurface)
    assert surface.weights is not None
    grids = np.asarray(surface.patches)
    return tuple(BezierSurface(surface.vertices[g], surface.weights[g]) for g in grids)


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_a_multipatch_of_separate_nets_has_the_mesh_of_indexed_patches(
    name: str, options: MeshOptions
) -> None:
    surface = find(name).surface()
    mesh, multipatch_mesh = (
        build(s.lower(), options)
        for s in (surface, MultipatchSurface(list_single_surfaces(surface), surface.up, name))
    )
    np.testing.assert_array_equal(mesh.positions, multipatch_mesh.positions)
    np.testing.assert_array_equal(mesh.triangles, multipatch_mesh.triangles)
    assert multipatch_mesh.report.watertight
    assert multipatch_mesh.report.deviation_bound == mesh.report.deviation_bound
    assert len(multipatch_mesh.parts) == mesh.report.patches


@pytest.mark.parametrize("options", OPTIONS)
def test_splines_that_form_a_ring_are_watertight_in_any_order(options: MeshOptions) -> None:
    """The splines are parts of a ring, split at knots; some are transposed or elevated."""
    ring = find("bspline-ring").surface()
    splines = list_single_surfaces(convert(ring, [Split(u=3.0, v=2.0)]))
    elevated_spline = convert(splines[1], [Elevate((4, 5))])
    assert isinstance(elevated_spline, BsplineSurface)
    for members in (splines, splines[::-1], (splines[0], elevated_spline, *splines[2:])):
        multipatch = MultipatchSurface(members, "z", "ring")
        surfaces: tuple[Surface, ...] = (multipatch,)
        if members is splines:
            transposed = convert(multipatch, [Transpose(), Reverse("v")])
            surfaces += (transposed, convert(multipatch, [Elevate((4, 5))]))
        for surface in surfaces:
            mesh = build(surface.lower(), options)
            assert mesh.report.watertight
            assert [part.name for part in mesh.parts] == [s.name for s in members]
        group = GroupSurface(
            (Member(multipatch), Member(multipatch, matrix=np.diag([2, 1, 1, 1.0])))
        )
        assert build(group.lower(), options).report.watertight


def test_parameters_of_points_refer_to_the_member_that_patch_names() -> None:
    """`patch` is the number of the member, and (u, v) is in the domain of that member."""
    hills, goblet, saddle = (find(n).surface() for n in ("bspline-hills", "nurbs-goblet", "saddle"))
    assert isinstance(hills, BsplineSurface)
    assert isinstance(goblet, BsplineSurface)
    assert isinstance(saddle, BezierSurface)
    members = (goblet, saddle, hills)
    model = MultipatchSurface(members).lower()
    models = [member.lower() for member in members]
    uv = np.array([[1.25, 2.5], [0.5, 0.25], [3, 3.75], [4, 11], [2, 2]])
    patch = np.array([0, 1, 2, 0, 2])
    result = evaluate_points(model, locate(model, PointsQuery(uv, patch, order=2)), order=2)
    for k, lowered in enumerate(models):
        rows = patch == k
        query = PointsQuery(uv[rows], None, order=2)
        expected = evaluate_points(lowered, locate(lowered, query), order=2)
        for name, column in expected.items():
            np.testing.assert_array_equal(result[name][rows], column)
    mesh = build(model, MeshOptions(resolution=(2, 2), uvs=True, weld=False))
    assert mesh.uvs is not None
    for part, lowered in zip(mesh.parts, models, strict=True):
        (domain,) = lowered.domains
        uvs = mesh.uvs[np.unique(mesh.triangles[slice(*part.triangles)])]
        ends = [domain.u[0], domain.v[0]], [domain.u[-1], domain.v[-1]]
        np.testing.assert_array_equal((uvs.min(axis=0), uvs.max(axis=0)), ends)
    for invalid_uv, members_of_places, pointer in (
        ([[9, 0]], [0], "/uv/0/0"),
        ([[1, 1], [0.5, 11.5]], [1, 0], "/uv/1/1"),
    ):
        query = PointsQuery(np.array(invalid_uv, float), np.array(members_of_places), order=0)
        with pytest.raises(InvalidRequest) as caught:
            locate(model, query)
        assert caught.value.issues[0].pointer == pointer


def test_empty_and_too_long_lists_and_different_channels_are_refused() -> None:
    saddle = find("saddle").surface()
    assert isinstance(saddle, BezierSurface)
    with_channels = replace(saddle, channels=Channels(uvs=np.zeros((1, 1, 2))))
    for surfaces, code, pointer in (
        ((), "wrong_length", "/surfaces"),
        ((saddle,) * (MAX_SURFACES + 1), "wrong_length", "/surfaces"),
        ((saddle, with_channels), "channel_shape", "/surfaces/1"),
    ):
        with pytest.raises(InvalidRequest) as caught:
            MultipatchSurface(surfaces)
        assert [(i.code, i.pointer) for i in caught.value.issues] == [(code, pointer)]
