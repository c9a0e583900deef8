"""What a supervisor is told that asks for it, as systemd does with `Type=notify`.

The protocol is that of sd_notify(3): a datagram to the socket that $NOTIFY_SOCKET names.
"""

import logging
import os
import socket

_log = logging.getLogger(__name__)


def notify(state: str) -> None:
    """Says one thing, `READY=1` say, if anybody asked; that nobody listens is no reason to stop."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return
    if address.startswith("@"):  # a name outside of the file system
        address = "\0" + address[1:]
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.connect(address)
            sock.send(state.encode())
    except OSError as error:
        _log.warning("the supervisor could not be told %s: %s", state, error.strerror)
