"""What CAD files hold of a model: bodies, each once, and their rigid instances.

Instances of STEP and IGES can turn and move bodies, and no more, as far as all readers agree. A
placement L x + t that also scales, shears or mirrors is taken apart, L = R U, into a rotation R and
the symmetric matrix U, by the polar decomposition; if L mirrors, U has negative eigenvalues. The
body is written a second time, transformed by U, for all instances that have the same U.

References
----------
Higham, Computing the polar decomposition, SIAM J. Sci. Stat. Comput. 7 (1986).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.models import NOT_PATCHES
from service.engine.outlines.outline import outline
from service.engine.scenes.placing import place_points, scalings
from service.errors import InvalidRequest
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import Color, GroupModel, Model, SingleModel

RIGID = 1e-13
"""A matrix that differs from a rotation by at most this is one: rounding errors are about 1e-16."""

MILLIMETRE = 0.001
"""The unit of models that have none, in metres."""


@dataclass(frozen=True, eq=False, slots=True)
class Definition:
    """Bodies that are placed together.

    Attributes
    ----------
    name : str
    bodies : tuple of BrepModel
    color : tuple of four floats, or None
        Of faces without a colour of their own.
    stretch : ndarray of float64, shape (3, 3), or None
        The symmetric matrix by which the bodies are to be transformed.
    """

    name: str
    bodies: tuple[BrepModel, ...]
    color: Color | None = None
    stretch: FloatArray | None = None

    def transformed_bodies(self) -> Iterator[BrepModel]:
        """The bodies after `stretch`, each transformed when it is asked for."""
        return (transform(body, self.stretch) for body in self.bodies)


@dataclass(frozen=True, eq=False, slots=True)
class Instance:
    """A node of the tree of instances: a placed definition, or a node with other nodes below it.

    Attributes
    ----------
    name : str
    definition : int or None
    matrix : ndarray of float64, shape (4, 4), or None
        A rotation and a translation, in the node above. None stands for the identity.
    parent : int
        The number of the node above, which comes earlier; −1 for the root of the file.
    """

    name: str
    definition: int | None
    matrix: FloatArray | None = None
    parent: int = -1


@dataclass(frozen=True, eq=False, slots=True)
class Assembly:
    """All that a file holds.

    Attributes
    ----------
    name : str
    definitions : tuple of Definition
    instances : tuple of Instance
        Empty if the file holds the only definition itself, without a placement.
    metres_per_unit : float
    is_unit_assumed : bool
        Whether the model has no unit.
    """

    name: str
    definitions: tuple[Definition, ...]
    instances: tuple[Instance, ...]
    metres_per_unit: float = MILLIMETRE
    is_unit_assumed: bool = True


def assemble(model: Model) -> Assembly:
    """The bodies and instances of a model.

    Raises
    ------
    InvalidRequest
        `not_parametric` for tubes and ribbons; its pointer is relative to the surface.
    """
    if not isinstance(model, GroupModel):
        return Assembly(model.name, (Definition(model.name, make_bodies(model)),), ())
    bodies = [make_bodies(each) for each in model.models]
    definitions: list[Definition] = []
    instances: list[Instance] = []
    numbers: dict[tuple[int, Color | None, bytes], int] = {}
    for member in model.members:
        matrix, stretch = split_rigid(member.matrix)
        key = member.model, member.color, b"" if stretch is None else _round(stretch).tobytes()
        number = numbers.setdefault(key, len(definitions))
        if number == len(definitions):
            name = model.models[member.model].name
            definitions.append(Definition(name, bodies[member.model], member.color, stretch))
        instances.append(Instance(member.name, number, matrix))
    return Assembly(model.name, tuple(definitions), tuple(instances))


def make_bodies(model: SingleModel) -> tuple[BrepModel, ...]:
    """The breps of a model."""
    if isinstance(model, SweepModel):
        raise InvalidRequest(NOT_PATCHES)
    return (model,) if isinstance(model, BrepModel) else outline(model)


def split_rigid(matrix: FloatArray | None) -> tuple[FloatArray | None, FloatArray | None]:
    """A rotation with a translation (4, 4), and the matrix U (3, 3) that is applied before it.

    None stands for the identity.
    """
    if matrix is None:
        return None, None
    linear = matrix[:3, :3]
    if np.abs(linear.T @ linear - np.eye(3)).max() <= RIGID and np.linalg.det(linear) > 0:
        return matrix, None
    left, values, right = np.linalg.svd(linear)
    rotation, stretch = left @ right, (right.T * values) @ right
    if np.linalg.det(rotation) < 0:
        rotation, stretch = -rotation, -stretch
    rigid = matrix.copy()
    rigid[:3, :3] = rotation
    return (None if np.array_equal(rigid, np.eye(4)) else rigid), stretch


def _round(stretch: FloatArray) -> FloatArray:
    """The matrix without the digits in which rounding makes equal ones differ."""
    scale = float(np.abs(stretch).max())
    rounded = np.round(stretch / scale * 2.0**40) + 0.0
    return np.append(rounded, np.round(np.log2(scale) * 2.0**32))


def transform(body: BrepModel, stretch: FloatArray | None) -> BrepModel:
    """The body after a linear map (3, 3); a map that mirrors turns the normals of faces around.

    Parameter curves stay, so the material stays on the left of each loop against du × dv.
    """
    if stretch is None:
        return body
    matrix = np.eye(4)
    matrix[:3, :3] = stretch
    largest = scalings(matrix)[1]
    return replace(
        body,
        vertices=place_points(body.vertices, matrix),
        vertex_uncertainties=body.vertex_uncertainties * largest,
        edge_uncertainties=body.edge_uncertainties * largest,
        uncertainty=body.uncertainty * largest,
        curves=replace(body.curves, points=place_points(body.curves.points, matrix)),
        surfaces=replace(body.surfaces, points=place_points(body.surfaces.points, matrix)),
        is_reversed=body.is_reversed ^ (np.linalg.det(stretch) < 0),
        prepared_box=None,
    )
