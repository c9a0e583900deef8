"""Conversions keep the points of every kind of surface, checked in exact arithmetic."""
