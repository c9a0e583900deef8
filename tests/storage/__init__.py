"""Tests of `service.storage`: where surfaces are kept, under their hashes."""
