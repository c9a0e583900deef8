"""Follows the recipes of CONTRIBUTING.md with small examples ("toys") in a copy of the checkout."""
