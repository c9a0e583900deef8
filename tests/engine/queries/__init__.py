"""Tests of `service/engine/queries/`."""
