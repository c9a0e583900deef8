"""Tests of service.api.observing."""
