"""The OpenAPI document: all calls, media types and errors, with computed examples."""
