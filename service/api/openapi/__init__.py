"""The OpenAPI document: every call, every media type, every error, with examples that are true."""
