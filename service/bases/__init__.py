"""Bases of polynomials and splines: mathematics without surfaces, with NumPy only."""
