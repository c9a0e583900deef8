"""Independent, slow and plain computations, with which tests compare results.

These modules import the classes of surfaces and of sections, but no computation of the service.
They use exact rational arithmetic (`exact`), limits of normals (`limits`), closed forms
(`quadrics`) and dense sampling (`sheets`, `deviation`), and count edges (`topology`).
"""
