"""Converts files to documents like those of requests: control nets, and parts of CAD systems."""
