"""Telemetry: request records, the access log, metrics, traces and health."""
