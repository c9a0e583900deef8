"""Measures of surfaces."""
