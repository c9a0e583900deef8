"""Tests of `service.api.caching`: cached responses, content codings and entity tags."""
