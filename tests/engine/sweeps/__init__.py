"""Tests of `service/engine/sweeps/`."""
