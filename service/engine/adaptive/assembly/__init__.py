"""A certified triangulation becomes a mesh: normals, channels, parts, lines."""
