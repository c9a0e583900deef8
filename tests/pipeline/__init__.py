"""Tests of `service.pipeline`, which makes the bytes of responses from requests."""
