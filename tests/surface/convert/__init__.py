"""Tests of conversions: they keep the points of every kind of surface, in exact arithmetic."""
