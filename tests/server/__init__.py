"""Tests of `service.server`: the process that serves, its connections and its log."""
