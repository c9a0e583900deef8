"""Responses that the service keeps in memory: entity tags, codings, and the cache."""
