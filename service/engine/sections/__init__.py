"""Sections of surfaces by planes: polylines within a tolerance; no loop is missing."""
