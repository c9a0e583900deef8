"""Trimmed faces: splines and surfaces of many faces at once, places, and pieces cut at knots."""
