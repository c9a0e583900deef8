"""Sections of whole parts by planes: loops that close at edges, whatever the gaps are."""
