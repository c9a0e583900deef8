"""Closest points of a surface to points, with proved intervals."""
