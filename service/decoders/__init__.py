"""Reads files of control nets as documents in the language of requests: one format a file."""
