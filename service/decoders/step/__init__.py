"""Reads STEP files: ISO 10303-21 with the schemas AP203, AP214 and AP242."""
