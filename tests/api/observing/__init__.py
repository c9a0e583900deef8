"""Tests of `service.api.observing`: health, log, metrics and traces."""
