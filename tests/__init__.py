"""Tests. The folders mirror those of `service/`; `oracles` has slow, independent computations, with
which tests compare results."""
