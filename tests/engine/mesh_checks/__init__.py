"""Tests of `service.engine.mesh_checks`."""
