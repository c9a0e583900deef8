"""The commands `points`, `project`, `intersect`, `section`, `measure` and `curve` as a table."""

from argparse import BooleanOptionalAction
from collections.abc import Collection
from pathlib import Path
from typing import Any

from service.cli.documents import Document, Query
from service.cli.flags import flag, option_texts, parse_number, parse_numbers
from service.cli.refusals import Refused
from service.cli.source import source_flag
from service.errors import SurfaceError

PLACES = ("uv", "barycentric", "patch")
"""The fields that name the places of a query of points."""

RAY_FIELDS = ("surface", "rays", "hits", "relative_thickness")
"""The fields of a request with rays. `/v1/intersect` also takes requests with planes."""

TOLERANCES = ("tolerance", "relative_tolerance")
PLANE_FIELDS = ("surface", "planes", *TOLERANCES)
"""The fields of a request with planes. `/v1/intersect` also takes requests with rays."""

SAMPLINGS = ("resolution", "tolerance", "parameters")
"""Options of a curve that replace each other."""


def _drop(document: Document, names: Collection[str]) -> Document:
    return {key: value for key, value in document.items() if key not in names}


def _merge_places(document: Document, values: Document) -> Document:
    """Places on the command line replace those in the file."""
    return _drop(document, PLACES) if {"uv", "barycentric"} & values.keys() else document


def _merge_points(document: Document, values: Document) -> Document:
    """Reads the points of `--points`, unless there are points on the command line."""
    file, source = values.pop("file", None), document["surface"]
    if file is not None and "points" not in values:
        values["points"] = _read_npy(file, "--points")
    if isinstance(source, dict) and "curve" in source and "type" not in source:
        # A request with a curve: it was taken for a surface, because it has no field `surface`.
        return source
    return document


def _read_npy(name: str, flag_name: str) -> Any:
    """The array in a .npy file; an error names the flag."""
    from service.decoders.npy import read_array

    try:
        return read_array(Path(name).read_bytes())
    except SurfaceError as error:
        raise Refused(*(f"{flag_name}: {issue.message}" for issue in error.issues)) from None


def _merge_rays(document: Document, values: Document) -> Document:
    """Reads rays as origins and directions. The file may also have a request with planes."""
    file, rows = values.pop("file", None), values.get("rays")
    if rows is None and file is not None:
        rows = _read_npy(file, "--rays").tolist()
    if rows is not None:
        if not all(isinstance(row, list) and len(row) == 6 for row in rows):
            raise Refused("a ray is six numbers: a point and a direction, X,Y,Z,DX,DY,DZ")
        origins, directions = [row[:3] for row in rows], [row[3:] for row in rows]
        values["rays"] = {"origins": origins, "directions": directions}
    return {key: value for key, value in document.items() if key in RAY_FIELDS}


def _merge_planes(document: Document, values: Document) -> Document:
    """Changes the planes of the file by the flags. The file may also have a request with rays."""
    kept = {key: value for key, value in document.items() if key in PLANE_FIELDS}
    normal, offsets, points = (values.pop(name, None) for name in ("normal", "offsets", "point"))
    if any(value is not None for value in (normal, offsets, points)):
        file_planes = kept.get("planes")
        planes = dict(file_planes) if isinstance(file_planes, dict) else {"normals": [[0, 0, 1]]}
        if normal is not None:
            planes["normals"] = [normal]
        # Offsets replace the points of the file, and points its offsets; with both flags, the model
        # refuses the planes.
        if offsets is not None:
            planes["offsets"] = offsets
            planes.pop("points", None)
        if points is not None:
            planes["points"] = points
            if offsets is None:
                planes.pop("offsets", None)
        values["planes"] = planes
    # Each of the two tolerances replaces both in the file.
    return _drop(kept, TOLERANCES) if any(name in values for name in TOLERANCES) else kept


def _merge_curve_options(document: Document, values: Document) -> Document:
    """Reads the texts of options as those of a query; a new choice of points replaces the old."""
    from service.schemas.query import values_from_text

    lists = values.pop("parameters", None)
    values.update(values_from_text(option_texts(values).items()))
    if lists is not None:
        values["parameters"] = [number for numbers in lists for number in numbers]
    is_new = any(name in values for name in SAMPLINGS)
    return _drop(document, SAMPLINGS) if is_new else document


POINTS = Query(
    "points",
    "write points, partials, normals and curvatures of a surface",
    "/v1/points",
    source_flag("places"),
    "places; --uv and --barycentric may be repeated",
    (
        flag("--uv", "parameters of a place", "U,V", type=parse_numbers, action="append"),
        flag(
            "--barycentric", "a place on a triangle", "R,S,T", type=parse_numbers, action="append"
        ),
        flag("--patch", "index of the patch or face, if there are several", "K", type=parse_number),
        flag("--derivatives", "0, 1 (default) or 2", "N", type=parse_number),
    ),
    _merge_places,
)

PROJECT = Query(
    "project",
    "write the closest points of a surface or a curve, with proofs",
    "/v1/project",
    source_flag("points", "; a request may have a curve instead of a surface"),
    "points",
    (
        flag(
            "--point",
            "a point; may be repeated",
            "X,Y,Z",
            type=parse_numbers,
            action="append",
            dest="points",
        ),
        flag("--points", "a .npy file of points, (m, 3)", "FILE", dest="file"),
        flag(
            "--relative-tolerance",
            "largest width of the interval that is proved to contain a distance, as a share of "
            "the diagonal (1e-9)",
            "X",
            type=parse_number,
        ),
        flag(
            "--sign",
            "write signs too: -1 inside a closed surface, 1 outside",
            action="store_const",
            const=True,
        ),
    ),
    _merge_points,
)

INTERSECT = Query(
    "intersect",
    "write where rays hit a surface; no hit is missed",
    "/v1/intersect",
    source_flag("rays"),
    "rays",
    (
        flag(
            "--ray",
            "a ray from a point in a direction; may be repeated",
            "X,Y,Z,DX,DY,DZ",
            type=parse_numbers,
            action="append",
            dest="rays",
        ),
        flag("--rays", "a .npy file with a ray in each row, (m, 6)", "FILE", dest="file"),
        flag(
            "--all",
            "all hits of each ray, not only the first",
            dest="hits",
            action="store_const",
            const="all",
        ),
        flag(
            "--relative-thickness",
            "how near a ray may pass to count as a hit, in diagonals (1e-9)",
            "X",
            type=parse_number,
        ),
    ),
    _merge_rays,
)

SECTION = Query(
    "section",
    "write where planes cut a surface: JSON, glTF, OBJ, OOGL, SVG",
    "/v1/intersect",
    source_flag("planes"),
    "planes",
    (
        flag("--normal", "normal of all planes (0,0,1)", "X,Y,Z", type=parse_numbers),
        flag(
            "--offsets",
            "distances of the planes from the origin, along the normal",
            "D,D,…",
            type=parse_numbers,
        ),
        flag(
            "--point",
            "instead of --offsets: a point of a plane; may be repeated",
            "X,Y,Z",
            type=parse_numbers,
            action="append",
        ),
        flag("--tolerance", "largest deviation, in model units", "DISTANCE", type=parse_number),
        flag(
            "--relative-tolerance", "largest deviation, in diagonals (1e-3)", "X", type=parse_number
        ),
    ),
    _merge_planes,
    has_formats=True,
)

MEASURE = Query(
    "measure",
    "write area, volume, centroid and borders of a surface, with proofs",
    "/v1/measure",
    source_flag("tolerance"),
    "intervals",
    (
        flag("--tolerance", "relative width of the intervals (1e-6)", "X", type=parse_number),
        flag(
            "--weld-tolerance",
            "distance within which borders are joined, as a share of the diagonal (1e-12)",
            "X",
            type=parse_number,
        ),
    ),
    reads_files=True,
)

IMAGE = Query(
    "image",
    "write a picture of a surface: PNG",
    "/v1/image",
    source_flag("picture"),
    "picture",
    (
        flag("--width", "pixels (512)", "N", type=parse_number),
        flag("--height", "pixels (512)", "N", type=parse_number),
        flag("--azimuth", "degrees about the vertical axis (30)", "ANGLE", type=parse_number),
        flag("--elevation", "degrees above the horizon (25)", "ANGLE", type=parse_number),
        flag("--zoom", "how much larger than a picture of the whole (1)", "X", type=parse_number),
        flag("--position", "instead of angles: where the camera is", "X,Y,Z", type=parse_numbers),
        flag("--target", "with --position: what is in the middle", "X,Y,Z", type=parse_numbers),
        flag("--field-of-view", "vertical, radians (0.5236)", "ANGLE", type=parse_number),
        flag("--orthographic", "without perspective", action="store_const", const=True),
        flag("--background", "transparent (default), or rrggbb", "COLOUR"),
        flag("--look", "shaded (default), gaussian or mean", "LOOK"),
        flag("--edges", "draw borders and edges", action="store_const", const=True),
        flag("--isocurves", "draw curves of every patch", "N", type=parse_number),
        flag("--control-net", "draw the control net", action="store_const", const=True),
    ),
    reads_files=True,
)

CURVE = Query(
    "curve",
    "write a curve as points or lines",
    "/v1/curve",
    flag(
        "source",
        "a JSON file (a curve, or a request with a curve and options), or - for standard input",
        "FILE",
    ),
    "options of the curve",
    (
        flag("--resolution", "divisions of every piece (16)", "N"),
        flag("--tolerance", "instead of --resolution: largest deviation", "DISTANCE"),
        flag(
            "--at --parameters",
            "instead of these: the parameters of the points; may be repeated",
            "T,T,…",
            type=parse_numbers,
            action="append",
            dest="parameters",
        ),
        flag("--derivatives", "0 (default) to 3: derivatives, curvature, torsion", "N"),
        flag("--tangents", "unit tangents (yes)", action=BooleanOptionalAction),
        flag("--arc-lengths", "arc length up to each point (yes)", action=BooleanOptionalAction),
    ),
    _merge_curve_options,
    has_formats=True,
    is_curve=True,
)
