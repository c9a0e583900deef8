"""Tests of `service.surface`: values of surfaces, and their lowering to Bézier patches."""
