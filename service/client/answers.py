"""The answers of the calls, by their fields; `docs/reference.md` and OpenAPI explain each field.

Columns of numbers are arrays; what the service leaves out is None.
"""

from typing import Any

from service.client.records import Answer, Bools, Floats, Ints, Record


class Interval(Answer):
    """An approximate number, and bounds that certainly contain the exact one."""

    value: float
    low: float
    high: float


class Points(Answer):
    """Points of a surface: row k belongs to the place k that was asked for."""

    positions: Floats
    du: Floats | None
    dv: Floats | None
    normals: Floats | None
    degenerate: Bools | None
    duu: Floats | None
    duv: Floats | None
    dvv: Floats | None
    gaussian_curvature: Floats | None
    mean_curvature: Floats | None
    principal_curvatures: Floats | None
    inside: list[bool | None] | None


class ClosestPoints(Answer):
    """Closest points of a surface or a curve: row k belongs to the point k that was asked for."""

    positions: Floats
    distances: Floats
    distance_bounds: Floats
    reached: Bools
    tied: Bools
    patch: Ints | None
    uv: Floats | None
    normals: Floats | None
    on_boundary: Bools | None
    near_edge: Bools | None
    signs: Floats | None
    parameters: Floats | None
    tangents: Floats | None
    skipped_faces: tuple[Record, ...] | None


class Intersections(Answer):
    """Hits of rays; or, for planes, their `sections` and the `report` on these."""

    reached: Bools | None
    counts: Ints | None
    ray: Ints | None
    t: Floats | None
    t_bounds: Floats | None
    positions: Floats | None
    patch: Ints | None
    uv: Floats | None
    normals: Floats | None
    kind: list[str] | None
    entering: list[bool | None] | None
    near_edge: Bools | None
    skipped_faces: tuple[Record, ...] | None
    sections: tuple[Record, ...] | None
    report: Record | None


class Curve(Answer):
    """Samples of a curve."""

    points: Floats
    tangents: Floats | None
    parameters: Floats
    arc_lengths: Floats | None
    dt: Floats | None
    degenerate: Bools | None
    dtt: Floats | None
    curvature: Floats | None
    dttt: Floats | None
    torsion: Floats | None
    report: Record


class Measures(Answer):
    """Area, lengths of borders and, of closed surfaces, volume: each with proved bounds."""

    area: Interval
    volume: Interval | None
    centroid: tuple[Interval, ...] | None
    closed: bool
    boundary_length: Interval
    boundary_count: int
    boundaries: tuple[Record, ...]
    open_edges: int
    inconsistent_edges: int
    faulty_edges: tuple[Record, ...]
    parts: tuple[Record, ...]
    reached: bool
    moved: float
    edge_lengths: tuple[Interval, ...] | None
    gap_bound: float | None
    skipped_faces: tuple[Record, ...] | None


class Deviation(Answer):
    """An interval that certainly contains the largest distance, and a place where it is `low`."""

    low: float
    high: float
    point: Floats
    triangle: int
    patch: int | None
    uv: Floats | None


class CheckedMesh(Answer):
    """A mesh as the service has read it."""

    vertices: Floats
    faces: Ints


class MeshCheck(Answer):
    """How far a mesh and its surface are apart, and the faults of the mesh itself."""

    surface_to_mesh: Deviation
    mesh_to_surface: Deviation
    open_edges: int
    non_manifold_edges: int
    flipped_edges: int
    degenerate_faces: int
    max_normal_angle: float | None
    max_normal_angle_triangle: int | None
    reached: bool
    limit: str | None
    vertices: int
    triangles: int
    skipped_faces: tuple[Record, ...] | None
    mesh: CheckedMesh | None
    distances: Floats | None
    middle_distances: Floats | None


class Estimate(Answer):
    """The size of a mesh before it is computed."""

    vertices: int
    triangles: int
    quads: int
    exact: bool
    bytes: Record
    exact_bytes: list[str]
    memory: Record
    accepted: bool
    certain: bool
    refused: tuple[Record, ...]


class MeshReport(Answer):
    """The report on a mesh."""

    vertices: int
    triangles: int
    quads: int
    patches: int
    bounds: Record
    watertight: bool
    boundary_edges: int
    poles_repaired: int
    closed_u: bool | None
    closed_v: bool | None
    continuity_u: str | None
    continuity_v: str | None
    deviation_bound: float | None
    mesh_deviation_bound: float | None
    mesh_deviation_reason: str | None
    reached: bool | None
    gap_bound: float | None
    pcurves_replaced: int | None
    complete: bool | None
    non_manifold_edges: int | None
    double_edges: int | None
    degenerate_faces: int | None
    collapsed_edges: Record | None
    skipped_faces: tuple[Record, ...] | None
    normal_angle: float | None
    curvature: Record | None
    merged_knots: int | None
    moved: float | None
    turned: list[int] | None
    not_orientable: list[int] | None
    metres_per_unit: float | None
    parts: tuple[Record, ...] | None
    engine: int


class Converted(Answer):
    """A surface in another form; every call takes it as it is."""

    surface: dict[str, Any]
    reading: Record | None
    orientation: Record | None


class Stored(Answer):
    """A stored surface; every call takes it as it is. Without a server it has no links."""

    id: str
    links: Record | None
    reading: Record | None


class Signed(Answer):
    """A URL that any client may read without a key until it expires."""

    url: str
    expires: int
