"""Tests of `service/engine/scenes/`."""
