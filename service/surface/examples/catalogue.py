"""The built-in example surfaces, with readable ids."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from types import MappingProxyType

from service.errors import Issue, UnknownSurface
from service.surface.examples import bodies, parts, patches, quadrics, splines, tea
from service.surface.kinds import Surface


@dataclass(frozen=True, slots=True)
class Example:
    """A built-in surface; the first call of `surface()` builds it by `build`."""

    id: str
    title: str
    description: str
    build: Callable[[], Surface]

    def surface(self) -> Surface:
        """The surface; the first call builds it, and later calls return the same object."""
        return _build(self.id)


def find(surface_id: str) -> Example:
    """The example of this id.

    Raises
    ------
    UnknownSurface
        No example has this id.
    """
    example = EXAMPLES.get(surface_id)
    if example is None:
        raise UnknownSurface(
            Issue(
                "unknown_surface",
                "No surface has this id.",
                got="an unknown id",
                needed="one of " + ", ".join(EXAMPLES),
            )
        )
    return example


@cache
def _build(surface_id: str) -> Surface:
    return EXAMPLES[surface_id].build()


EXAMPLES: Mapping[str, Example] = MappingProxyType(
    {
        example.id: example
        for example in (
            Example(
                "utah-teapot",
                "Utah teapot",
                "Martin Newell's teapot of 1975 with Frank Crow's bottom, in its usual "
                "proportions: 32 bicubic patches over 306 control points, z up, normals outward.",
                lambda: patches.teapot("utah-teapot", 1.0),
            ),
            Example(
                "utah-teapot-original",
                "Utah teapot, original height",
                "The teapot as Newell measured it, a third taller than usual.",
                lambda: patches.teapot("utah-teapot-original", 4.0 / 3.0),
            ),
            Example(
                "bourke-1111",
                "Random surface",
                "Paul Bourke's random 6 × 5 control net (seed 1111), one patch of degree (5, 4).",
                lambda: patches.net("bourke-1111", "z"),
            ),
            Example(
                "bourke-1111-colors",
                "Random surface, coloured by its height",
                "The surface `bourke-1111` with `colors`: a net in the surface's own degree, from "
                "blue in the valleys to yellow on the hills.",
                lambda: patches.color_by_height("bourke-1111", "z"),
            ),
            Example(
                "tveit",
                "Tutorial patch",
                "A bicubic patch over 16 control points, taken from a tutorial.",
                lambda: patches.net("tveit", "y"),
            ),
            Example(
                "saddle",
                "Saddle",
                "The patch of degree (1, 1) over four corners: the hyperbolic paraboloid z = xy.",
                patches.saddle,
            ),
            Example(
                "heated-panel",
                "Heated panel",
                "A biquadratic panel with the attribute `temperature`, colours that follow it, and "
                "texture coordinates in metres: each in a net with its own degree.",
                patches.heated_panel,
            ),
            Example(
                "cylinder",
                "Cylinder",
                "Exact cylinder of radius 1 and height 2 with its caps: rational, degree (2, 1).",
                quadrics.cylinder,
            ),
            Example(
                "cone",
                "Cone",
                "Exact cone of radius 1 and height 2 with its base: rational, degree (2, 1).",
                quadrics.cone,
            ),
            Example(
                "sphere",
                "Sphere",
                "Exact unit sphere: eight rational patches of degree (2, 2) meeting at two poles.",
                quadrics.sphere,
            ),
            Example(
                "torus",
                "Torus",
                "Exact torus of radius 1, tube radius 0.4: sixteen rational biquadratic patches.",
                quadrics.torus,
            ),
            Example(
                "monkey-saddle",
                "Monkey saddle",
                "z = x³ − 3xy² over a triangle, a saddle for two legs and a tail: one triangular "
                "patch of degree 3.",
                patches.monkey_saddle,
            ),
            Example(
                "octahedral-sphere",
                "Sphere of eight triangles",
                "Exact unit sphere without poles: eight rational triangular patches of degree 4.",
                quadrics.octahedral_sphere,
            ),
            Example(
                "rounded-box",
                "Rounded box",
                "Box with round edges, exact and smooth everywhere: 18 rational patches of degree "
                "(4, 4), and eight triangles of degree 4 as its corners.",
                quadrics.rounded_box,
            ),
            Example(
                "trefoil-tube",
                "Trefoil knot",
                "A closed tube about a trefoil knot, which is a periodic cubic B-spline: "
                "watertight, its rings meet without a twist.",
                splines.trefoil_tube,
            ),
            Example(
                "ribbon",
                "Ribbon",
                "A stripe along a cubic B-spline; it faces +z, and its width is a Bézier function "
                "that begins and ends at 0.",
                splines.streamer,
            ),
            Example(
                "hair",
                "Hair",
                "A tube along one curve of degree 7 whose radius tapers to a point.",
                splines.curl,
            ),
            Example(
                "tea-service",
                "Tea service",
                "A group: the teapot, four cups and saucers around it and a tray, each placed and "
                "coloured; the cups are one surface, two of them mirrored.",
                lambda: tea.tea_service(patches.teapot("utah-teapot", 1.0)),
            ),
            Example(
                "bspline-hills",
                "Hills",
                "A uniform bicubic B-spline over 7 × 8 control points; it touches none of them.",
                splines.hills,
            ),
            Example(
                "nurbs-goblet",
                "Goblet",
                "A NURBS surface of revolution, degree (2, 3): exact circles, sharp at foot and "
                "rim, closed at two poles.",
                splines.goblet,
            ),
            Example(
                "bspline-ring",
                "Ring",
                "A bicubic B-spline, periodic in u and v: it closes with continuous curvature.",
                splines.ring,
            ),
            Example(
                "swept-wing",
                "Swept wing",
                "A closed body of four B-splines: two skins whose knots crowd at the leading edge, "
                "down to 1e-8 of their range, and ruled caps at root and tip.",
                bodies.wing,
            ),
            Example(
                "ship-hull",
                "Ship",
                "Nine B-splines of three degrees as one closed surface: the sides, port and "
                "starboard, the keel, the deck and the transom share their borders.",
                bodies.hull,
            ),
            Example(
                "plate-with-holes",
                "Plate with holes",
                "A plate with round edges and three holes, one countersunk: 30 trimmed faces.",
                partial(parts.part, "plate-with-holes"),
            ),
            Example(
                "pipe-tee",
                "Pipe tee",
                "Two pipes that meet at a right angle, with a fillet between them: 9 faces.",
                partial(parts.part, "pipe-tee"),
            ),
            Example(
                "gear",
                "Gear",
                "A spur gear with a bore: 87 faces, most of them planes between straight edges.",
                partial(parts.part, "gear"),
            ),
            Example(
                "impeller",
                "Impeller",
                "A hub with six free-form blades on a disc: 35 faces.",
                partial(parts.part, "impeller"),
            ),
            Example(
                "screw-thread",
                "Screw thread",
                "A shaft with a thread that runs around it more than once.",
                partial(parts.part, "screw-thread"),
            ),
            Example(
                "crossed-holes",
                "Crossed holes",
                "A round-edged block with holes that cross inside of it.",
                partial(parts.part, "crossed-holes"),
            ),
        )
    }
)
"""The examples by id, in the order in which the service lists them."""
