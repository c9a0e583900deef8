"""Tests of service.api.caching."""
