"""The OpenAPI document: every call, every media type, every error, with computed examples."""
