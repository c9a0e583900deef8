"""Conversions of surfaces: to higher degrees, pieces, other directions of u and v, other kinds.

No conversion changes the shape of a surface.
"""
