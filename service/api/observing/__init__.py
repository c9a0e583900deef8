"""Telemetry: request records, the access log, metrics and traces; and health checks."""
