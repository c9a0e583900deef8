"""Judges meshes of many random surfaces: compares the bounds in their files with samples."""
