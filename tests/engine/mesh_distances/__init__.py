"""Tests of service.engine.mesh_distances."""
