"""The guard: asks who it is and whether they may, before anything else sees the request.

It stands in front of the answers that are kept, so that these are guarded too; where nothing is
configured it does not stand there at all.
"""

from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.cors import CrossOrigin, Origins
from service.api.guard.key_file import KnownKeys
from service.api.guard.keys import InvalidKeys, bearer, entries, owner
from service.api.guard.policy import Policy
from service.api.guard.refusals import key_needed, key_unknown, refusal
from service.errors import InvalidSettings, SurfaceError
from service.settings.values import Settings


def guarded(app: ASGIApp, settings: Settings, origins: Origins) -> ASGIApp:
    """The application behind its guard, or as it is where there is nothing to guard.

    Raises
    ------
    InvalidSettings
        Where the settings that say who may do what make no sense, by themselves or together.
    """
    policy = Policy(settings)
    if settings.metrics == "key" and not policy.has_keys:
        raise InvalidSettings(
            "SURFACE_METRICS: got 'key' where there are no keys, needed SURFACE_API_KEYS too."
        )
    if not policy.has_keys:
        return app
    return Guard(app, policy, _known_keys(settings), origins)


class Guard:
    """Hands on what is allowed; answers all else by itself.

    The name of a key that is known, never the key, is left in the state of the request, as `key`.
    """

    def __init__(self, app: ASGIApp, policy: Policy, keys: KnownKeys, origins: Origins) -> None:
        self._app = app
        self._policy = policy
        self._keys = keys
        self._origins = origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http" or _is_preflight(scope):
            await self._app(scope, receive, send)
            return
        try:
            self._admit(scope)
        except SurfaceError as error:
            scope["state"]["problem"] = error.issues[0].code
            # Scripts of other origins shall be able to read why.
            answer = CrossOrigin(refusal(error), self._origins)
            await answer(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _admit(self, scope: Scope) -> None:
        """Lets a request pass, or raises what is in its way."""
        state = scope.setdefault("state", {})
        key = bearer(_header(scope, b"authorization"))
        if key is not None and (name := owner(key, self._keys())) is not None:
            state["key"] = name
        need = self._policy.need(scope["method"], route_path(scope))
        if need != "nothing" and "key" not in state:
            raise key_needed() if key is None else key_unknown()


def route_path(scope: Scope) -> str:
    """The path below the one that the application is mounted at."""
    path: str = scope["path"]
    root: str = scope.get("root_path", "")
    return path[len(root) :] if root and path.startswith(root + "/") else path


def _is_preflight(scope: Scope) -> bool:
    """Whether a browser asks if it may ask: it never sends a key with that."""
    return scope["method"] == "OPTIONS" and any(
        name == b"access-control-request-method" for name, _ in scope["headers"]
    )


def _header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header that may stand there once; None where it does not."""
    found = [value for each, value in scope["headers"] if each == name]
    return found[0] if len(found) == 1 else None


def _known_keys(settings: Settings) -> KnownKeys:
    name = "SURFACE_API_KEYS"
    try:
        listed = entries(settings.api_keys)
        name = "SURFACE_API_KEYS_FILE" if settings.api_keys_file else name
        return KnownKeys(listed, settings.api_keys_file)
    except InvalidKeys as error:
        raise InvalidSettings(f"{name}: {error}") from None
