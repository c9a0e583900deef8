"""Judges meshes of the service and of other mesh makers by `POST /v1/check`: `make judge-peers`."""
