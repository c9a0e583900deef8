"""Points, partials, normals and curvatures at given parameters."""
