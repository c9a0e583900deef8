"""Conversions: the same points in exact arithmetic, whatever the kind of surface."""
