"""Filling meshes at a given resolution, and the value that is their result."""
