"""Tests of how a surface is computed."""
