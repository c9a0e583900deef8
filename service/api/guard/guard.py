"""The guard: checks keys, signatures and rates of each request.

It is in front of the cache and the routes, so it guards cached responses too. If the settings have
no keys, secrets, rates and proxies, the application runs without a guard.
"""

import time
from dataclasses import dataclass

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.caching.cached_response import RawHeaders
from service.api.callers import caller_of
from service.api.cors import is_preflight
from service.api.guard.key_file import KnownKeys
from service.api.guard.keys import KeyEntry, find_entry, parse_bearer, parse_entries
from service.api.guard.policy import (
    EXEMPT,
    JOBS,
    Policy,
    build_refusal,
    key_needed,
    key_unknown,
    needs_keys,
    private_headers,
    rate_limited,
    scope_needed,
    scope_of,
)
from service.api.guard.proxies import Proxies
from service.api.guard.rates import Item, Rates, compute_item, rate_headers
from service.api.guard.signatures import Signer, is_signed
from service.api.record import record_of, route_path
from service.errors import InvalidSettings, SurfaceError
from service.fair.accounts import Accounts
from service.settings.values import Settings

_HSTS = (b"strict-transport-security", b"max-age=31536000")
"""Tells browsers to use https for a year (RFC 6797).

Sent only if a trusted proxy says that the client used https.
"""


@dataclass(slots=True)
class _GuardResult:
    """Additions of the guard to the response.

    `headers`: further headers. `is_private`: whether shared caches must not keep the response.
    `seconds_left`: until the signature expires; None without a signature. `retry_after`: seconds
    after which the client may try again. `limits`: the limit of requests, with its state.
    `caller`: whose computing time the headers have; None if they have none.
    """

    headers: list[tuple[bytes, bytes]]
    is_private: bool = False
    seconds_left: int | None = None
    retry_after: int = 0
    limits: tuple[Item, ...] = ()
    caller: str | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Guard:
    """Passes allowed requests on; answers all others itself.

    The guard sets the name and the scopes of the key in the request record, never the key itself.
    In the ASGI scope it sets the client's address, `client`, and the query without its signature:
    so the application sees the URL that was signed. A check that the settings do not configure is
    None.
    """

    app: ASGIApp
    policy: Policy
    keys: KnownKeys | None
    signer: Signer | None
    rates: Rates | None
    proxies: Proxies | None
    accounts: Accounts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        result = _GuardResult([])
        app = self.app
        try:
            self._check_access(scope, result)
        except SurfaceError as error:
            record_of(scope).code = error.issues[0].code
            app = build_refusal(error, result.retry_after)

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers: RawHeaders = tuple(message.get("headers", ()))
                if result.is_private:
                    headers = private_headers(headers, result.seconds_left)
                rates = self._rate_headers(result)
                message = {**message, "headers": [*headers, *result.headers, *rates]}
            await send(message)

        has_limits = result.limits or result.caller is not None
        has_additions = result.headers or result.is_private or has_limits
        await app(scope, receive, send_with_headers if has_additions else send)

    def _check_access(self, scope: Scope, result: _GuardResult) -> None:
        """Returns if the request is allowed; otherwise raises the error for its response."""
        if self.proxies is not None:
            self.proxies.set_client(scope)
            if scope["scheme"] == "https":
                result.headers.append(_HSTS)
        if is_preflight(scope):
            return
        path = route_path(scope)
        need = self.policy.need(scope["method"], path)
        has_key, entry = self._find_key(scope)
        name = None if entry is None else entry.name
        if entry is not None:
            record = record_of(scope)
            record.key, record.scopes = entry.name, entry.scopes
        # On a path for monitoring, only a request without the key that it needs counts.
        if path not in EXEMPT or (need != "nothing" and name is None):
            self._count_request(scope, result)
        allows_signature = need == "key or signature"
        # Caches must not keep what only some clients may read.
        result.is_private = allows_signature or (need == "key" and path.startswith(JOBS))
        # Also where nothing is needed: the application must see the query without its signature.
        if need != "key" and self.signer is not None and is_signed(path, scope["query_string"]):
            now = time.time()
            query, expires = self.signer.verify(path, scope["query_string"], now)
            scope["query_string"] = query
            result.seconds_left = int(expires - now)
        elif need != "nothing":
            if entry is None:
                raise key_unknown() if has_key else key_needed(or_signature=allows_signature)
            if (needed_scope := scope_of(scope["method"], path)) not in entry.scopes:
                raise scope_needed(needed_scope)

    def _find_key(self, scope: Scope) -> tuple[bool, KeyEntry | None]:
        """Whether the request has a key, and the entry of that key if the service knows it."""
        key = None if self.keys is None else parse_bearer(_header(scope, b"authorization"))
        if self.keys is None or key is None:
            return False, None
        return True, find_entry(key, self.keys())

    def _count_request(self, scope: Scope, result: _GuardResult) -> None:
        """Counts a request for its key, or without a valid key for its address.

        Raises
        ------
        RateLimited
        """
        if self.accounts.limit is not None:
            result.caller = caller_of(scope)
        if self.rates is None:
            return
        decision = self.rates.count(caller_of(scope))
        result.limits = (self.rates.item(decision),)
        if not decision.is_allowed:
            result.retry_after = decision.retry_after
            raise rate_limited(self.rates.limit, decision.retry_after)

    def _rate_headers(self, result: _GuardResult) -> RawHeaders:
        """The headers of the limits, with the computing time as of now."""
        items, limit = result.limits, self.accounts.limit
        if limit is not None and result.caller is not None:
            self.accounts.charge_running()
            items += (compute_item(limit.seconds, limit.state(result.caller)),)
        return rate_headers(items) if items else ()


def _header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header; None if it is missing or repeated."""
    values = [value for header, value in scope["headers"] if header == name]
    return values[0] if len(values) == 1 else None


def build_guard(
    app: ASGIApp,
    settings: Settings,
    keys: KnownKeys | None,
    signer: Signer | None,
    accounts: Accounts,
) -> ASGIApp:
    """The application behind a guard, or unchanged if there is nothing to check.

    Raises
    ------
    InvalidSettings
        The settings of rates and proxies are invalid, or those of access contradict each other.
    """
    policy = Policy(settings)
    rates = Rates(settings.rate_limit) if settings.rate_limit else None
    proxies = Proxies(settings.trusted_proxies) if settings.trusted_proxies else None
    if settings.metrics == "key" and keys is None:
        raise InvalidSettings(
            "SURFACE_METRICS: got 'key' without API keys, needed SURFACE_API_KEYS too."
        )
    if not settings.public_reads and keys is None and signer is None:
        raise InvalidSettings(
            "SURFACE_PUBLIC_READS: got 'false' where no client could read, needed SURFACE_API_KEYS "
            "or SURFACE_SIGNING_KEYS too."
        )
    if all(check is None for check in (keys, signer, rates, proxies, accounts.limit)):
        return app
    return Guard(app, policy, keys, signer, rates, proxies, accounts)


def build_signer(settings: Settings) -> Signer | None:
    """The signer of URLs; None if the settings have no secrets.

    Raises
    ------
    InvalidSettings
        A secret is too short, or listed twice.
    """
    secrets = [secret.get_secret_value() for secret in settings.signing_keys]
    return Signer(secrets) if secrets else None


def build_keys(settings: Settings) -> KnownKeys | None:
    """The keys that the service knows; None if the settings have none.

    Raises
    ------
    InvalidSettings
        An entry, or the file of keys, is invalid.
    """
    if not needs_keys(settings):
        return None
    name = "SURFACE_API_KEYS"
    try:
        entries = parse_entries(settings.api_keys)
        name = "SURFACE_API_KEYS_FILE" if settings.api_keys_file else name
        return KnownKeys(entries, settings.api_keys_file)
    except InvalidSettings as error:
        raise InvalidSettings(f"{name}: {error}") from None
