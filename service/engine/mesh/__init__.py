"""Meshes at a given resolution: connectivity, plans that are made once, and filling them."""
