"""The readers of single entities of a file, which all others share."""

from dataclasses import dataclass

from service.decoders.iges.attributes import Attributes
from service.decoders.iges.budget import Budget
from service.decoders.iges.curves import CurveReader
from service.decoders.iges.entities import IgesFile
from service.decoders.iges.surfaces import SurfaceReader
from service.decoders.iges.transformations import Transformations


@dataclass(frozen=True, eq=False, slots=True)
class Readers:
    """A file, and the readers of its matrices, curves, surfaces, names and colours."""

    file: IgesFile
    transformations: Transformations
    curves: CurveReader
    surfaces: SurfaceReader
    attributes: Attributes

    @classmethod
    def of(cls, file: IgesFile, max_control_points: int) -> "Readers":
        """The readers of a file, of which no more control points are read."""
        transformations = Transformations(file)
        budget = Budget(max_control_points, len(file.directory))
        curves = CurveReader(file, transformations, budget)
        surfaces = SurfaceReader(file, transformations, curves, budget)
        return cls(file, transformations, curves, surfaces, Attributes(file))
