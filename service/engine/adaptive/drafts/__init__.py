"""A draft, which is a mesh during refinement: leaves, their polygons, samples and triangles."""
