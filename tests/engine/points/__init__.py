"""Tests of `service/engine/points/`."""
