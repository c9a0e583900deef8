"""Where surfaces are kept: whole objects under their hashes, in a folder or a bucket."""
