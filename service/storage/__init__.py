"""Stores surfaces as objects under their hashes, in a folder, in memory or in a bucket."""
