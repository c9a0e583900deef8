"""The guard as the settings want it; they are checked here, where they are put to use."""

from starlette.types import ASGIApp

from service.api.cors import Origins
from service.api.guard.guard import Guard, Means
from service.api.guard.key_file import KnownKeys
from service.api.guard.keys import InvalidKeys, entries
from service.api.guard.policy import Policy
from service.api.guard.proxies import InvalidProxies, Proxies
from service.api.guard.rates import Rates
from service.api.guard.signatures import InvalidSecrets, Signer
from service.errors import InvalidSettings
from service.settings.values import Settings


def guarded(app: ASGIApp, settings: Settings, origins: Origins) -> ASGIApp:
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
            "SURFACE_PUBLIC_READS: got 'false' where nobody could read, needed SURFACE_API_KEYS "
            "or SURFACE_SIGNING_KEYS too."
        )
    if means == Means(None, None, None, None):
        return app
    return Guard(app, policy, means, origins)


def signer_of(settings: Settings) -> Signer | None:
    """What signs addresses, if there are secrets for that; raises InvalidSettings for weak ones."""
    if not settings.signing_keys:
        return None
    try:
        return Signer([secret.get_secret_value() for secret in settings.signing_keys])
    except InvalidSecrets as error:
        raise InvalidSettings(f"SURFACE_SIGNING_KEYS: {error}") from None


def _keys(settings: Settings) -> KnownKeys:
    name = "SURFACE_API_KEYS"
    try:
        listed = entries(settings.api_keys)
        name = "SURFACE_API_KEYS_FILE" if settings.api_keys_file else name
        return KnownKeys(listed, settings.api_keys_file)
    except InvalidKeys as error:
        raise InvalidSettings(f"{name}: {error}") from None


def _proxies(settings: Settings) -> Proxies | None:
    if not settings.trusted_proxies:
        return None
    try:
        return Proxies(settings.trusted_proxies)
    except InvalidProxies as error:
        raise InvalidSettings(f"SURFACE_TRUSTED_PROXIES: {error}") from None
