"""The formats of sections, and their registry."""
