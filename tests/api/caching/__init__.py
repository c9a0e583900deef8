"""Answers that may be kept."""
