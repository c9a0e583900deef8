"""The formats of curves and of sections, and their registry."""
