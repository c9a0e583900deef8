"""Points, partials, normals and curvatures at parameters that were asked for."""
