"""Meshes of parts: edges, borders of faces, triangulation, refinement and assembly."""
