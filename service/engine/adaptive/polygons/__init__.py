"""Cells and borders joined: polygons through all vertices, and triangles out of them."""
