"""A mesh that is being refined: leaves, their polygons, samples, triangles and hosts."""
