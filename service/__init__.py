"""Surface Service: parametric surfaces in, meshes out."""

__version__ = "0.1.0"
