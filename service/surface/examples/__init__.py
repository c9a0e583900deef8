"""The built-in surfaces."""
