"""Whole parts, ready for questions: trimmed faces, edges, and untrimmed patches, as nets."""
