"""Until when an address is to be good, and whether that may be."""

from service.api.guard.signatures import EXPIRES, PATHS, SIGNATURE, Signer
from service.errors import InvalidRequest, Issue
from service.schemas.request import MAX_SECONDS, SignRequest


def signed_address(signer: Signer, wanted: SignRequest, root: str, now: float) -> tuple[str, int]:
    """The address with its signature, and until when it is good.

    Nothing is looked up: whether there is such a surface is found out by whoever reads it.

    Parameters
    ----------
    root : str
        The path that the service is mounted at; addresses have it, signatures do not.

    Raises
    ------
    InvalidRequest
        Where it cannot be signed, or not for so long.
    """
    expires = int(now) + wanted.seconds if wanted.seconds is not None else wanted.expires
    if expires is None:
        raise ValueError("a request without an end was not validated")
    if not now < expires <= now + MAX_SECONDS:
        raise InvalidRequest(
            Issue(
                "out_of_range",
                "An address is signed for seven days at most.",
                f"/{EXPIRES}",
                "a moment in the past" if expires <= now else "a moment too far away",
                f"1 to {MAX_SECONDS} seconds from now",
            )
        )
    path, _, query = wanted.url.partition("?")
    try:
        if not (wanted.url.isascii() and wanted.url.isprintable()) or set(" #") & set(wanted.url):
            raise ValueError
        signed = signer.signed(path.removeprefix(root), query, expires)
    except ValueError:
        raise InvalidRequest(
            Issue(
                "wrong_value",
                "This is no address that can be signed.",
                "/url",
                "another text",
                f"{PATHS}, with a query or without, and without `{EXPIRES}` or `{SIGNATURE}`",
            )
        ) from None
    return f"{path}?{signed}", expires
