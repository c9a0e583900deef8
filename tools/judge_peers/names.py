"""Names of the parts and of the families whose meshes are judged."""

PARTS = (
    *("bolt", "box", "cone", "cylinder", "ellip", "frustum", "loft", "nut", "pipe", "revolve"),
    *("sliver", "sphere", "sphere_hole", "spring", "steinmetz", "torus", "torus_cut", "tray"),
    *("viviani", "wavy"),
)
"""Solids of `tools.benchmarks.solid_models`; the other six are among the built-in examples."""

FAMILIES = (
    *("bicubic, moderate", "bicubic, wild", "rational", "degree 15", "NURBS", "spikes"),
    *("sine ridges", "rings and tori"),
)
"""Families of `tools.certify.surfaces`."""

SEEDS = 1
"""Surfaces of each family: those of the first seeds."""

SAME_SHAPE = ("bourke-1111-colors", "utah-teapot-original")
"""Examples that are left out, because another one has the same shape."""
