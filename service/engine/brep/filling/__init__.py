"""Triangles inside of polygons: triangulation, bounds, refinement."""
