"""Where a service listens, as its environment says, known without reading all the settings.

Whoever only asks it something need not wait for pydantic and NumPy.
"""

import os
import re

from service.errors import InvalidSettings

PREFIX = "SURFACE_"
"""What the environment variables of all settings begin with."""

HOST, PORT = "127.0.0.1", 8000
"""Where it listens if nothing is said."""

_EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""What listens at every address of a machine is asked at its own one."""


def listening_at(host: str | None, port: str | None) -> tuple[str, int]:
    """Host and port to ask a service of this machine at: what is given, else what variables say.

    Raises
    ------
    InvalidSettings
        Where the port is none that can be asked.
    """
    host = host or os.environ.get(f"{PREFIX}HOST") or HOST
    name = f"{PREFIX}PORT" if port is None else "--port"
    text = os.environ.get(f"{PREFIX}PORT", str(PORT)) if port is None else port
    if not (re.fullmatch(r"\s*[0-9]{1,5}\s*", text) and 1 <= int(text) <= 65535):
        raise InvalidSettings(f"{name}: got {text!r}, needed a whole number from 1 to 65535.")
    return _EVERYWHERE.get(host, host), int(text)
