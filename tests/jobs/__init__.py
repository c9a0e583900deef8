"""Tests of `service.jobs`: parts, batches, engines, and jobs in the store."""
