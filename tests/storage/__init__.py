"""Tests of the places where surfaces are kept."""
