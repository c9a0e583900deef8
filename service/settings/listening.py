"""The host and port of the service on this machine, read without the other settings.

A command that only sends a request, such as `surface health`, need not import pydantic and NumPy.
"""

import os
import re

from service.errors import InvalidSettings

PREFIX = "SURFACE_"
"""The first letters of every setting's environment variable."""

HOST, PORT = "127.0.0.1", 8000
"""The default address."""

_WILDCARDS = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""For a host that means all addresses: the loopback address at which the service can be reached."""


def find_address(host: str | None, port: str | None) -> tuple[str, int]:
    """Host and port of the service on this machine, from the arguments or from the environment.

    The variables are SURFACE_HOST and SURFACE_PORT; a wildcard host becomes the loopback address.

    Raises
    ------
    InvalidSettings
        The port is not a whole number from 1 to 65535.
    """
    host = host or os.environ.get(f"{PREFIX}HOST") or HOST
    name = f"{PREFIX}PORT" if port is None else "--port"
    text = os.environ.get(f"{PREFIX}PORT", str(PORT)) if port is None else port
    if not (re.fullmatch(r"\s*[0-9]{1,5}\s*", text) and 1 <= int(text) <= 65535):
        raise InvalidSettings(f"{name}: got {text!r}, needed a whole number from 1 to 65535.")
    return _WILDCARDS.get(host, host), int(text)
