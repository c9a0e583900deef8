"""The readers of single entities of a file, which all others share."""

from dataclasses import dataclass

from service.decoders.format import FileLimits
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
    budget: Budget

    @classmethod
    def of(cls, file: IgesFile, limits: FileLimits) -> "Readers":
        """The readers of a file, which read no more than the limits allow."""
        transformations = Transformations(file)
        budget = Budget(limits, len(file.directory))
        curves = CurveReader(file, transformations, budget)
        surfaces = SurfaceReader(file, transformations, curves, budget)
        return cls(file, transformations, curves, surfaces, Attributes(file), budget)
