"""Tests of the products, step by step."""
