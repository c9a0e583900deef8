"""The guard: checks keys, signatures and rates before any other part sees the request.

It stands in front of the cache, so cached responses are guarded too. Without keys, secrets, rates
and proxies in the settings, the application runs without a guard.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.caching.cached_response import RawHeaders
from service.api.cors import is_preflight
from service.api.guard.keys import InvalidKeys, KnownKeys, bearer, owner, parse_entries
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
"""One year (RFC 6797); sent only if a trusted proxy says that the client used https."""


@dataclass(frozen=True, slots=True)
class Checks:
    """The checks of the guard; a check that the settings do not configure is None."""

    keys: KnownKeys | None
    signer: Signer | None
    rates: Rates | None
    proxies: Proxies | None


@dataclass(slots=True)
class _GuardResult:
    """The guard's result for a request, and its additions to the response.

    `added`: headers. `private`: whether shared caches must not keep the response. `left`: seconds
    until the signature expires. `wait`: seconds until the client may try again.
    """

    added: list[tuple[bytes, bytes]]
    private: bool = False
    left: int | None = None
    wait: int = 0


@dataclass(frozen=True, eq=False, slots=True)
class Guard:
    """Passes allowed requests on; answers all others itself.

    It sets the key's name in the request record (never the key); and in the scope the client's
    address, `client`, and the query without its signature, so that the parts behind it see the URL
    that was signed.
    """

    app: ASGIApp
    policy: Policy
    checks: Checks

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        result = _GuardResult([])
        app = self.app
        try:
            self._admit(scope, result)
        except SurfaceError as error:
            record_of(scope).code = error.issues[0].code
            app = refusal(error, result.wait)

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers: RawHeaders = tuple(message.get("headers", ()))
                if result.private:
                    headers = private_headers(headers, result.left)
                message = {**message, "headers": [*headers, *result.added]}
            await send(message)

        await app(scope, receive, sent if result.added or result.private else send)

    def _admit(self, scope: Scope, result: _GuardResult) -> None:
        """Returns if the request is allowed; otherwise raises the error for its response."""
        if self.checks.proxies is not None:
            self.checks.proxies.set_client(scope)
            if scope["scheme"] == "https":
                result.added.append(_HSTS)
        if is_preflight(scope):
            return
        path = route_path(scope)
        need = self.policy.need(scope["method"], path)
        sent, name = self._key(scope)
        if name is not None:
            record_of(scope).key = name
        if path not in EXEMPT or (need != "nothing" and name is None):
            self._count(scope, name, result)
        result.private = need == "key or signature"
        signer = self.checks.signer
        if need != "key" and signer is not None and is_signed(path, scope["query_string"]):
            now = time.time()
            query, expires = signer.check(path, scope["query_string"], now)
            scope["query_string"] = query
            result.left = int(expires - now)
        elif need != "nothing" and name is None:
            raise key_unknown() if sent else key_needed(signature=result.private)

    def _key(self, scope: Scope) -> tuple[bool, str | None]:
        """Whether the request has a key, and the name of that key if the service knows it."""
        keys = self.checks.keys
        key = None if keys is None else bearer(_header(scope, b"authorization"))
        if keys is None or key is None:
            return False, None
        return True, owner(key, keys())

    def _count(self, scope: Scope, name: str | None, result: _GuardResult) -> None:
        """Counts a request for its key; without a valid key, for its address."""
        rates = self.checks.rates
        if rates is None:
            return
        client = scope.get("client")
        decision = rates.take(caller(name, client[0] if client else None))
        result.added.extend(rates.headers(decision))
        if not decision.allowed:
            result.wait = decision.wait
            raise rate_limited(rates.limit, decision.wait)


def _header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header; None if it is missing or repeated."""
    values = [value for each, value in scope["headers"] if each == name]
    return values[0] if len(values) == 1 else None


def build_guard(app: ASGIApp, settings: Settings) -> ASGIApp:
    """The application behind a guard, or unchanged if there is nothing to check.

    Raises
    ------
    InvalidSettings
        The settings of keys, secrets, rates and proxies are invalid, or contradict each other.
    """
    policy = Policy(settings)
    checks = Checks(
        keys=_keys(settings) if policy.has_keys else None,
        signer=signer_of(settings),
        rates=Rates(settings.rate_limit) if settings.rate_limit else None,
        proxies=_proxies(settings),
    )
    if settings.metrics == "key" and not policy.has_keys:
        raise InvalidSettings(
            "SURFACE_METRICS: got 'key' without API keys, needed SURFACE_API_KEYS too."
        )
    if not settings.public_reads and not policy.has_keys and checks.signer is None:
        raise InvalidSettings(
            "SURFACE_PUBLIC_READS: got 'false' where no client could read, needed SURFACE_API_KEYS "
            "or SURFACE_SIGNING_KEYS too."
        )
    if checks == Checks(None, None, None, None):
        return app
    return Guard(app, policy, checks)


def signer_of(settings: Settings) -> Signer | None:
    """The signer of URLs, or None without secrets; raises `InvalidSettings` for weak ones."""
    if not settings.signing_keys:
        return None
    with _name_setting("SURFACE_SIGNING_KEYS"):
        return Signer([secret.get_secret_value() for secret in settings.signing_keys])


def _keys(settings: Settings) -> KnownKeys:
    with _name_setting("SURFACE_API_KEYS"):
        listed = parse_entries(settings.api_keys)
    with _name_setting("SURFACE_API_KEYS_FILE" if settings.api_keys_file else "SURFACE_API_KEYS"):
        return KnownKeys(listed, settings.api_keys_file)


def _proxies(settings: Settings) -> Proxies | None:
    if not settings.trusted_proxies:
        return None
    with _name_setting("SURFACE_TRUSTED_PROXIES"):
        return Proxies(settings.trusted_proxies)


@contextmanager
def _name_setting(name: str) -> Iterator[None]:
    """Adds the setting's name to an error."""
    try:
        yield
    except (InvalidKeys, InvalidProxies, InvalidSecrets) as error:
        raise InvalidSettings(f"{name}: {error}") from None
