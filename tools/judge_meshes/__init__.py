"""Tests the answers of `POST /v1/check` with meshes and with faults: `make judge-meshes`."""
