"""Bodies that are in a file and not in the result, and references to other files."""

from service.decoders.step.entities import Entities
from service.decoders.step.solids import MODELS, SOLIDS
from service.decoders.step.tally import Tally

OTHER_BODIES = (
    "BLOCK",
    "BOOLEAN_RESULT",
    "COMPLEX_TRIANGULATED_FACE",
    "CSG_SOLID",
    "CUBIC_BEZIER_TRIANGULATED_FACE",
    "EDGE_BASED_WIREFRAME_MODEL",
    "EXTRUDED_AREA_SOLID",
    "EXTRUDED_FACE_SOLID",
    "GEOMETRIC_CURVE_SET",
    "GEOMETRIC_SET",
    "REVOLVED_AREA_SOLID",
    "REVOLVED_FACE_SOLID",
    "RIGHT_ANGULAR_WEDGE",
    "RIGHT_CIRCULAR_CONE",
    "RIGHT_CIRCULAR_CYLINDER",
    "SHELL_BASED_WIREFRAME_MODEL",
    "SPHERE",
    "SWEPT_DISK_SOLID",
    "TESSELLATED_GEOMETRIC_SET",
    "TESSELLATED_SHELL",
    "TESSELLATED_SOLID",
    "TESSELLATED_WIRE",
    "TORUS",
    "TRIANGULATED_FACE",
    "TRIANGULATED_SURFACE_SET",
)
"""Bodies and sets of curves and triangles that are not read, in AP203, AP214 and AP242."""

FILES = "DOCUMENT_FILE"


def tally_unread(entities: Entities, seen: set[int], tally: Tally) -> None:
    """Count bodies that are in the file but in no product.

    Parameters
    ----------
    seen : set of int
        Numbers of entities that are read, or counted already.
    """
    for keyword in (*SOLIDS, *MODELS, *OTHER_BODIES):
        rows = entities.instances.rows_of(keyword)
        numbers = entities.instances.numbers[rows].tolist() if rows else []
        count = sum(number not in seen for number in numbers)
        if count:
            tally.skip(keyword, count)
        seen.update(numbers)


def count_references(entities: Entities) -> int:
    """How many other files the file refers to; none of them is opened."""
    return len(entities.instances.rows_of(FILES)) + entities.instances.count_external()
