"""Checks the recipes of CONTRIBUTING.md with small examples ("toys") in a copy of this checkout."""
