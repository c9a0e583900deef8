"""Tests of `service/engine/evaluation/`."""
