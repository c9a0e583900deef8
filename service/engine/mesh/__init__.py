"""Meshes at a given resolution: connectivity and plans, made once, and filling them."""
