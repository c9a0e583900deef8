"""Tests of `service.fair`: accounts of callers, turns between them, and the compute limit."""
