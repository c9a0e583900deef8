"""Tests of `service/engine/mesh/`."""
