"""A bucket in memory with a part of S3's interface, for tests with faults: get, put and list.

It knows which access keys are valid: requests with another key get 403, as with a wrong secret.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler
from re import search
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape

from tools.live import serve

BUCKET = "surfaces"
TIME = "2026-01-01T00:00:00.000Z"
"""When all objects were written, as this bucket says."""


class Bucket:
    """The objects of the bucket, by key, and the access keys that are valid."""

    def __init__(self, valid_keys: set[str]) -> None:
        self.objects: dict[str, bytes] = {}
        self.valid_keys = valid_keys
        self.lock = threading.Lock()

    def environment(self, url: str, access_key: str) -> dict[str, str]:
        """The settings of an instance that stores in this bucket, served at this URL."""
        return {
            "SURFACE_STORE": f"s3://{BUCKET}",
            "AWS_ENDPOINT_URL": url,
            "AWS_ALLOW_HTTP": "true",
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": access_key,
            "AWS_SECRET_ACCESS_KEY": "secret",
        }

    def list(self, prefix: str, after: str, delimiter: str) -> str:
        """The XML of a listing (ListObjectsV2), which is always complete."""
        with self.lock:
            sizes = {key: len(content) for key, content in self.objects.items()}
        keys = sorted(key for key in sizes if key.startswith(prefix) and key > after)
        folders: dict[str, None] = {}
        lines = []
        for key in keys:
            folder, has_more, _ = key[len(prefix) :].partition(delimiter or "\0")
            if has_more:
                folders[prefix + folder + delimiter] = None
            else:
                lines.append(
                    f"<Contents><Key>{escape(key)}</Key><Size>{sizes[key]}</Size>"
                    f'<LastModified>{TIME}</LastModified><ETag>"0"</ETag></Contents>'
                )
        lines += [
            f"<CommonPrefixes><Prefix>{escape(name)}</Prefix></CommonPrefixes>" for name in folders
        ]
        return (
            f"<ListBucketResult><Name>{BUCKET}</Name><IsTruncated>false</IsTruncated>"
            f"{''.join(lines)}</ListBucketResult>"
        )


@contextmanager
def serve_bucket(bucket: Bucket) -> Iterator[str]:
    """The URL of a server of this bucket, until the block ends."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"  # keeps connections

        def _respond(self, status: int, content: bytes = b"") -> None:
            self.send_response(status)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("ETag", '"0"')
            self.send_header("Last-Modified", "Thu, 01 Jan 2026 00:00:00 GMT")
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(content)

        def _handle(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            key = search(r"Credential=([^/]+)/", self.headers.get("Authorization", ""))
            if key is None or key[1] not in bucket.valid_keys:
                self._respond(403, b"<Error><Code>SignatureDoesNotMatch</Code></Error>")
                return
            url = urlsplit(self.path)
            name = unquote(url.path).removeprefix(f"/{BUCKET}").lstrip("/")
            if not name:
                query = {key: value for key, (value, *_) in parse_qs(url.query).items()}
                listing = bucket.list(
                    query.get("prefix", ""),
                    query.get("start-after", ""),
                    query.get("delimiter", ""),
                )
                self._respond(200, listing.encode())
                return
            with bucket.lock:
                content = bucket.objects.get(name)
                if self.command == "PUT":
                    bucket.objects[name] = body
            if self.command == "PUT":
                self._respond(200)
            elif content is None:
                self._respond(404, b"<Error><Code>NoSuchKey</Code></Error>")
            else:
                self._respond(200, content)

        do_GET = do_HEAD = do_PUT = _handle  # noqa: N815

        def log_message(self, *_: object) -> None:
            """Writes no log."""

    with serve(Handler) as url:
        yield url
