"""Tests of `service/engine/curves/`."""
