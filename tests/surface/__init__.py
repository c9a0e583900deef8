"""Tests of what a surface is, and of its lowering to patches."""
