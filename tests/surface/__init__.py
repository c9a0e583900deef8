"""Tests of service.surface."""
