"""Meshes by tolerance: divided where the surface bends, closed at the seams, and certified."""
