"""Parts in another unit of length."""

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Edge, Face, Part, Surface


def scale_part(part: Part, factor: float) -> Part:
    """A part whose lengths are multiplied by a factor; parameters and pcurves stay."""
    if factor == 1.0:
        return part
    edges = tuple(
        Edge(
            edge.vertices,
            None if edge.curve is None else scale_curve(edge.curve, factor),
            edge.is_degenerate,
            None if edge.uncertainty is None else edge.uncertainty * factor,
        )
        for edge in part.edges
    )
    faces = tuple(
        Face(
            scale_surface(face.surface, factor), face.loops, face.is_reversed, face.name, face.color
        )
        for face in part.faces
    )
    return Part(
        part.name,
        part.vertices * factor,
        edges,
        faces,
        part.shells,
        None if part.uncertainty is None else part.uncertainty * factor,
        part.color,
    )


def scale_curve(curve: Curve, factor: float) -> Curve:
    """A curve of space, scaled."""
    return Curve(curve.degree, curve.knots, _scale(curve.points, factor))


def scale_surface(surface: Surface, factor: float) -> Surface:
    """A surface, scaled."""
    return Surface(surface.degrees, surface.knots, _scale(surface.points, factor))


def scale_matrix(matrix: FloatArray, factor: float) -> FloatArray:
    """A placement (4, 4) of parts that are scaled: only its translation changes."""
    scaled = matrix.copy()
    scaled[:3, 3] *= factor
    return scaled


def _scale(net: FloatArray, factor: float) -> FloatArray:
    """Homogeneous points whose coordinates, not the weights, are multiplied."""
    scaled: FloatArray = net * (factor, factor, factor, 1.0)
    return scaled
