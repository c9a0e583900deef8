"""Samples of edges, and the polygons of loops: bounds beside them, crossings, windings."""
