"""Conversions of surfaces that keep their points: degrees, pieces, directions, kinds."""
