"""Signed URLs: each can be read without a key, until the time in its query.

The signature is HMAC-SHA-256 (RFC 2104) over a text: its purpose (`_PREFIX`), the path, and all
parameters of the query in a fixed order. So one signature is valid for GET and HEAD, and for every
order and escaping of the query. Another path, parameter or time needs another signature.
"""

import hmac
import re
from base64 import urlsafe_b64encode
from collections.abc import Sequence
from urllib.parse import parse_qsl, unquote_plus, urlencode

from service.api.errors import SignatureExpired, SignatureInvalid
from service.encoders.registry import FORMATS
from service.errors import InvalidRequest, InvalidSettings, Issue
from service.schemas.request import MAX_SECONDS, SignRequest

EXPIRES, SIGNATURE = "expires", "signature"
"""The parameters that signing adds: a Unix time, and 32 bytes as 43 letters of Base64."""

MIN_SECRET = 32
"""Fewest letters of a secret: as many bytes as the hash (RFC 2104, section 3)."""

MAX_PARAMETERS = 100
"""Most parameters of a signed query: no surface or mesh has as many options."""

PATHS = "/v1/surfaces/{id}, /v1/surfaces/{id}/mesh.{suffix} or /v1/surfaces/{id}/image.png"
"""URLs that can be signed, in words."""

_PATH = re.compile(
    r"/v1/surfaces/[0-9a-z-]{1,64}(?:/image\.png|/mesh\.(?:"
    + "|".join(fmt.suffix for fmt in FORMATS)
    + "))?"
)
_TIME = re.compile("[0-9]{1,12}")
_PREFIX = "surface-service 1\nread\n"
"""Names the purpose: a signature made with this secret for another purpose is not valid here."""

_Pairs = list[tuple[str, str]]


class Signer:
    """Signs with the first secret, and accepts signatures of all secrets.

    Raises
    ------
    InvalidSettings
        A secret is too short, or listed twice.
    """

    def __init__(self, secrets: Sequence[str]) -> None:
        if any(len(secret) < MIN_SECRET for secret in secrets):
            raise InvalidSettings(
                "SURFACE_SIGNING_KEYS: one secret is too short; "
                f"needed {MIN_SECRET} letters or more each."
            )
        if len(set(secrets)) < len(secrets):
            raise InvalidSettings(
                "SURFACE_SIGNING_KEYS: one secret is listed twice; needed each secret once."
            )
        self._secrets = [secret.encode() for secret in secrets]

    def sign(self, path: str, query: str, expires: int) -> str:
        """The query with `expires` and the signature added; for this path only.

        Raises
        ------
        ValueError
            The path does not name a surface or a mesh, or the query is signed already.
        """
        pairs = _parse_pairs(query)
        if not is_signable(path) or any(name in (EXPIRES, SIGNATURE) for name, _ in pairs):
            raise ValueError("this cannot be signed")
        pairs.append((EXPIRES, str(expires)))
        signature = _signature(self._secrets[0], path, pairs)
        return "&".join(
            ([query] if query else []) + [f"{EXPIRES}={expires}", f"{SIGNATURE}={signature}"]
        )

    def verify(self, path: str, query: bytes, now: float) -> tuple[bytes, int]:
        """The query without the parameters that signing added, and its expiry in Unix time.

        Tries all secrets, each in constant time, so that the time reveals nothing of the signature.
        A signature that expires in more than seven days is refused too: a program with the secret
        could otherwise make URLs that no one can withdraw without a new secret.

        Raises
        ------
        SignatureInvalid, SignatureExpired
        """
        try:
            text = query.decode("ascii")
            pairs = _parse_pairs(text)
            (expires,) = (value for name, value in pairs if name == EXPIRES)
            (signature,) = (value for name, value in pairs if name == SIGNATURE)
        except ValueError:
            raise _build_invalid_error() from None
        signed_pairs = [(name, value) for name, value in pairs if name != SIGNATURE]
        matches = [
            hmac.compare_digest(_signature(secret, path, signed_pairs).encode(), signature.encode())
            for secret in self._secrets
        ]
        if not (is_signable(path) and any(matches) and _TIME.fullmatch(expires)):
            raise _build_invalid_error()
        if int(expires) <= now:
            raise SignatureExpired(
                Issue(
                    "signature_expired",
                    "The signature of this URL has expired.",
                    f"/{EXPIRES}",
                    got="a time in the past",
                    needed="a URL that is signed again",
                )
            )
        if int(expires) > now + MAX_SECONDS:
            raise SignatureInvalid(
                Issue(
                    "out_of_range",
                    "A URL can be signed for at most seven days.",
                    f"/{EXPIRES}",
                    got="a time too far in the future",
                    needed=f"at most {MAX_SECONDS} seconds from now",
                )
            )
        other_parts = (
            part
            for part in text.split("&")
            if unquote_plus(part.partition("=")[0]) not in (EXPIRES, SIGNATURE)
        )
        return "&".join(other_parts).encode(), int(expires)


def is_signable(path: str) -> bool:
    """Whether a path is one that signed URLs may have."""
    return _PATH.fullmatch(path) is not None


def is_signed(path: str, query: bytes) -> bool:
    """Whether a URL seems to have a signature, by a quick look; `Signer.verify` parses it."""
    return b"signature=" in query and path.startswith("/v1/surfaces/")


def _parse_pairs(query: str) -> _Pairs:
    """The query's parameters; raises ValueError for invalid UTF-8 or too many parameters."""
    return parse_qsl(query, keep_blank_values=True, errors="strict", max_num_fields=MAX_PARAMETERS)


def _signature(secret: bytes, path: str, pairs: _Pairs) -> str:
    text = f"{_PREFIX}{path}\n{urlencode(sorted(pairs))}"
    digest = hmac.digest(secret, text.encode(), "sha256")
    return urlsafe_b64encode(digest).rstrip(b"=").decode()


def _build_invalid_error() -> SignatureInvalid:
    return SignatureInvalid(
        Issue(
            "signature_invalid",
            "The signature does not belong to this URL.",
            f"/{SIGNATURE}",
            got="another signature",
            needed="the whole URL, as it was signed",
        )
    )


def build_signed_url(
    signer: Signer, request: SignRequest, root: str, now: float
) -> tuple[str, int]:
    """The URL with its signature, and its expiry in Unix time.

    Does not check that the surface exists: a client learns this when it reads the URL.

    Parameters
    ----------
    root : str
        The path that the service is mounted at; URLs have it, signatures do not.

    Raises
    ------
    InvalidRequest
        The URL cannot be signed, or not for this time.
    """
    expires = int(now) + request.seconds if request.seconds is not None else request.expires
    if expires is None:
        raise ValueError("the request has neither `seconds` nor `expires`: it was not validated")
    if not now < expires <= now + MAX_SECONDS:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                "A URL can be signed for at most seven days.",
                f"/{EXPIRES}",
                got="a time in the past" if expires <= now else "a time too far in the future",
                needed=f"1 to {MAX_SECONDS} seconds from now",
            )
        )
    url = request.url
    path, _, query = url.partition("?")
    try:
        if not (url.isascii() and url.isprintable()) or set(" #") & set(url):
            raise ValueError
        signed = signer.sign(path.removeprefix(root), query, expires)
    except ValueError:
        message, got = "This URL cannot be signed.", "another text"
        needed = f"{PATHS}, with a query or without, and without `{EXPIRES}` or `{SIGNATURE}`"
        raise InvalidRequest(Issue("wrong_value", message, "/url", got, needed)) from None
    return f"{path}?{signed}", expires
