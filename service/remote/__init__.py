"""Requests to a service at a URL, for the command line (`--url`)."""
