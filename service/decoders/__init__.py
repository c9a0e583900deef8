"""Converts files of control nets to documents like those of requests; a module for each format."""
