"""Breps made ready for meshing: regions, parameter curves, checks, for any tolerance."""
