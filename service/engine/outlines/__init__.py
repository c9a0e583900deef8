"""Surfaces of patches as breps: a face for each spline, edges where borders are equal."""
