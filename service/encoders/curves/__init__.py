"""The formats of curves, and their registry."""
