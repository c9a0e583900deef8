"""Readers of compressed bodies: those of the standard library, or of its backport."""

import gzip
import sys

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

unpacked_gzip = gzip.decompress
unpacked_zstd = zstd.decompress
