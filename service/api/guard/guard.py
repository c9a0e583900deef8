"""The guard: asks who it is and whether they may, before anything else sees the request.

It stands in front of the answers that are kept, so that these are guarded too; where nothing is
configured it does not stand there at all.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.caching.entries import RawHeaders
from service.api.cors import is_preflight
from service.api.guard.keys import InvalidKeys, KnownKeys, bearer, entries, owner
from service.api.guard.policy import (
    EXEMPT,
    Policy,
    key_needed,
    key_unknown,
    private_headers,
    rate_limited,
    refusal,
)
from service.api.guard.proxies import InvalidProxies, Proxies
from service.api.guard.rates import Rates, caller
from service.api.guard.signatures import InvalidSecrets, Signer, is_signed
from service.api.links import route_path
from service.api.observing.record import record_of
from service.errors import InvalidSettings, SurfaceError
from service.settings.values import Settings

_HSTS = (b"strict-transport-security", b"max-age=31536000")
"""A year (RFC 6797); said only where a trusted proxy says that it was asked by https."""


@dataclass(frozen=True, slots=True)
class Means:
    """What the guard works with; None for what is not configured."""

    keys: KnownKeys | None
    signer: Signer | None
    rates: Rates | None
    proxies: Proxies | None


@dataclass(slots=True)
class _Pass:
    """What is added to the answer, whatever it is; and how private it is.

    `left` is for how many seconds an address is still good; `wait`, how many are to be waited.
    """

    added: list[tuple[bytes, bytes]]
    private: bool = False
    left: int | None = None
    wait: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class Guard:
    """Hands on what is allowed; answers all else by itself.

    It leaves in the request record the name of a key that is known, never the key; and in the scope
    who asks, as `client`, and the query without its signature, so that whatever comes after it sees
    the address that was signed.
    """

    app: ASGIApp
    policy: Policy
    means: Means

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        found = _Pass([])
        app = self.app
        try:
            self._admit(scope, found)
        except SurfaceError as error:
            record_of(scope).code = error.issues[0].code
            app = refusal(error, found.wait)

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers: RawHeaders = tuple(message.get("headers", ()))
                if found.private:
                    headers = private_headers(headers, found.left)
                message = {**message, "headers": [*headers, *found.added]}
            await send(message)

        await app(scope, receive, sent if found.added or found.private else send)

    def _admit(self, scope: Scope, found: _Pass) -> None:
        """Lets a request pass, or raises what is in its way."""
        if self.means.proxies is not None:
            self.means.proxies.introduce(scope)
            if scope["scheme"] == "https":
                found.added.append(_HSTS)
        if is_preflight(scope):
            return
        path = route_path(scope)
        need = self.policy.need(scope["method"], path)
        sent, name = self._key(scope)
        if name is not None:
            record_of(scope).key = name
        if path not in EXEMPT or (need != "nothing" and name is None):
            self._count(scope, name, found)
        found.private = need == "key or signature"
        signer = self.means.signer
        if need != "key" and signer is not None and is_signed(path, scope["query_string"]):
            now = time.time()
            query, expires = signer.check(path, scope["query_string"], now)
            scope["query_string"] = query
            found.left = int(expires - now)
        elif need != "nothing" and name is None:
            raise key_unknown() if sent else key_needed(signature=found.private)

    def _key(self, scope: Scope) -> tuple[bool, str | None]:
        """Whether a key was sent, and its name, if it is one of ours."""
        keys = self.means.keys
        key = None if keys is None else bearer(_header(scope, b"authorization"))
        if keys is None or key is None:
            return False, None
        return True, owner(key, keys())

    def _count(self, scope: Scope, name: str | None, found: _Pass) -> None:
        """Counts a request to whoever makes it; what brings a wrong key, to its address."""
        rates = self.means.rates
        if rates is None:
            return
        client = scope.get("client")
        taken = rates.take(caller(name, client[0] if client else None))
        found.added.extend(rates.headers(taken))
        if not taken.allowed:
            found.wait = taken.wait
            raise rate_limited(rates.limit, taken.wait)


def _header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header that may stand there once; None where it does not."""
    found = [value for each, value in scope["headers"] if each == name]
    return found[0] if len(found) == 1 else None


def guarded(app: ASGIApp, settings: Settings) -> ASGIApp:
    """The application behind its guard, or as it is where there is nothing to guard.

    Raises
    ------
    InvalidSettings
        Where the settings that say who may do what make no sense, by themselves or together.
    """
    policy = Policy(settings)
    means = Means(
        keys=_keys(settings) if policy.has_keys else None,
        signer=signer_of(settings),
        rates=Rates(settings.rate_limit) if settings.rate_limit else None,
        proxies=_proxies(settings),
    )
    if settings.metrics == "key" and not policy.has_keys:
        raise InvalidSettings(
            "SURFACE_METRICS: got 'key' where there are no keys, needed SURFACE_API_KEYS too."
        )
    if not settings.public_reads and not policy.has_keys and means.signer is None:
        raise InvalidSettings(
            "SURFACE_PUBLIC_READS: got 'false' where no client could read, needed SURFACE_API_KEYS "
            "or SURFACE_SIGNING_KEYS too."
        )
    if means == Means(None, None, None, None):
        return app
    return Guard(app, policy, means)


def signer_of(settings: Settings) -> Signer | None:
    """What signs addresses, if there are secrets for that; raises InvalidSettings for weak ones."""
    if not settings.signing_keys:
        return None
    with _checking("SURFACE_SIGNING_KEYS"):
        return Signer([secret.get_secret_value() for secret in settings.signing_keys])


def _keys(settings: Settings) -> KnownKeys:
    with _checking("SURFACE_API_KEYS"):
        listed = entries(settings.api_keys)
    with _checking("SURFACE_API_KEYS_FILE" if settings.api_keys_file else "SURFACE_API_KEYS"):
        return KnownKeys(listed, settings.api_keys_file)


def _proxies(settings: Settings) -> Proxies | None:
    if not settings.trusted_proxies:
        return None
    with _checking("SURFACE_TRUSTED_PROXIES"):
        return Proxies(settings.trusted_proxies)


@contextmanager
def _checking(name: str) -> Iterator[None]:
    """Says which setting makes no sense."""
    try:
        yield
    except (InvalidKeys, InvalidProxies, InvalidSecrets) as error:
        raise InvalidSettings(f"{name}: {error}") from None
