"""Reads files of control nets as documents like those of requests: a module for each format."""
