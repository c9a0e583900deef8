"""Sections of surfaces by planes: polylines within a tolerance, no loop of which is lost."""
