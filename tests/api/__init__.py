"""Tests of `service.api`: requests and responses over HTTP."""
