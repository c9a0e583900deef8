"""Telemetry: the access log, metrics and traces; and health checks."""
