"""Bases of polynomials and splines: mathematics that knows no surface; NumPy only."""
