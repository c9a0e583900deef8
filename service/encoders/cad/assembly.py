"""The content of CAD files: bodies, each once, and their rigid instances.

Instances of STEP and IGES can turn and move bodies, and no more, as far as all readers agree. A
placement L x + t that also scales, shears or mirrors is taken apart, L = R U, into a rotation R and
the symmetric matrix U, by the polar decomposition; if L mirrors, U has negative eigenvalues. The
body is written a second time, transformed by U, for all instances that have the same U.

References
----------
Higham, Computing the polar decomposition, SIAM J. Sci. Stat. Comput. 7 (1986).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.cad.format import WritingReport
from service.encoders.units import MILLIMETRE
from service.engine.models import NOT_PATCHES
from service.engine.outlines.complete import complete
from service.engine.outlines.outline import outline
from service.engine.scenes.placing import place_points, scalings
from service.errors import InvalidRequest, Issue
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import Color, GroupModel, GroupNode, Model, SingleModel
from service.surface.placement import is_identity

RIGID = 1e-13
"""A matrix that differs from a rotation by at most this is one: rounding errors are about 1e-16."""

NO_GEOMETRY = Issue(
    "no_geometry",
    "All faces of the surface are invalid and left out.",
    "",
    "no faces",
    "at least one valid face",
)


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

    def transformed_bodies(self, scale: float = 1.0) -> Iterator[BrepModel]:
        """The bodies after `stretch` and a scaling, each transformed when it is asked for."""
        stretch = self.stretch
        if scale != 1.0:
            stretch = scale * (np.eye(3) if stretch is None else stretch)
        return (transform(body, stretch) for body in self.bodies)


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

    def list_below(self) -> list[list[int]]:
        """For each instance the numbers of those right below it, and at last those of the root."""
        below: list[list[int]] = [[] for _ in range(len(self.instances) + 1)]
        for number, instance in enumerate(self.instances):
            below[instance.parent].append(number)  # the parent −1 is the last list
        return below

    def report(self) -> WritingReport:
        """The report on a file of this assembly."""
        bodies = [body for definition in self.definitions for body in definition.bodies]
        placed = sum(instance.definition is not None for instance in self.instances)
        return WritingReport(
            faces=sum(len(body.shell_faces) for body in bodies),
            definitions=len(self.definitions),
            instances=placed if self.instances else 1,
            metres_per_unit=self.metres_per_unit,
            is_unit_assumed=self.is_unit_assumed,
        )


def assemble(model: Model, metres_per_unit: float | None = None) -> Assembly:
    """The bodies and instances of a model; without a unit, one unit is a millimetre.

    Raises
    ------
    InvalidRequest
        `not_parametric` for tubes and ribbons; `no_geometry` if all faces are left out. Pointers
        are relative to the surface.
    """
    models = model.models if isinstance(model, GroupModel) else (model,)
    bodies = [make_bodies(each) for each in models]
    if not any(bodies):
        raise InvalidRequest(NO_GEOMETRY)
    if isinstance(model, GroupModel):
        definitions, instances = _place(model, bodies)
    else:
        definitions, instances = (Definition(model.name, bodies[0]),), ()
    metres = MILLIMETRE if metres_per_unit is None else metres_per_unit
    return Assembly(model.name, definitions, instances, metres, metres_per_unit is None)


def _place(
    model: GroupModel, bodies: Sequence[tuple[BrepModel, ...]]
) -> tuple[tuple[Definition, ...], tuple[Instance, ...]]:
    """The definitions of a group, and its nodes, each placed by a rotation and a translation.

    A node hands its stretch down: to the bodies of the node, and to the nodes below it.
    """
    nodes = model.nodes or tuple(
        GroupNode(member.name, None, member.matrix, copy)
        for copy, member in enumerate(model.members)
    )
    definitions: list[Definition] = []
    instances: list[Instance] = []
    stretches: list[FloatArray | None] = []
    numbers: dict[tuple[int, Color | None, bytes], int] = {}
    for node in nodes:
        given = None if node.parent is None else stretches[node.parent]
        matrix, stretch = split_rigid(_multiply(given, node.matrix))
        stretches.append(stretch)
        number = None
        if node.copy is not None:
            copy = model.members[node.copy]
            key = copy.model, copy.color, b"" if stretch is None else _round(stretch).tobytes()
            number = numbers.setdefault(key, len(definitions))
            if number == len(definitions):
                name = model.models[copy.model].name
                definitions.append(Definition(name, bodies[copy.model], copy.color, stretch))
        parent = -1 if node.parent is None else node.parent
        instances.append(Instance(node.name, number, matrix, parent))
    return tuple(definitions), tuple(instances)


def _multiply(stretch: FloatArray | None, matrix: FloatArray | None) -> FloatArray | None:
    """The placement (4, 4) that first places, and then stretches by a matrix (3, 3)."""
    if stretch is None:
        return matrix
    product = np.eye(4)
    product[:3, :3] = stretch
    return product if matrix is None else product @ matrix


def make_bodies(model: SingleModel) -> tuple[BrepModel, ...]:
    """The breps of a model; a brep of which all faces are left out has none."""
    if isinstance(model, SweepModel):
        raise InvalidRequest(NOT_PATCHES)
    if isinstance(model, BrepModel):
        return (complete(model),) if len(model.shell_faces) else ()
    return outline(model)


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
    return (None if is_identity(rigid) else rigid), stretch


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
