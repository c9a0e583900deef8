"""Tests of `service/engine/wires/`."""
