"""Decompresses gzip and Zstandard, with the standard library or its backport for older Python."""

import gzip
import sys

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

decompress_gzip = gzip.decompress
decompress_zstd = zstd.decompress
