"""Readers of compressed bodies: those of the standard library, or of what stands in for it."""

import gzip
import sys

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

unpacked_gzip = gzip.decompress
unpacked_zstd = zstd.decompress
