"""Opens the store that the setting SURFACE_STORE names."""

import re
import tempfile
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from anyio import CapacityLimiter
from obstore.exceptions import BaseError
from obstore.store import LocalStore, MemoryStore, from_url

from service.errors import InvalidSettings
from service.storage.backends import STAGING, Bucket, Folder, make_folder
from service.storage.failures import DISK_FULL, reason_of
from service.storage.keys import SURFACES
from service.storage.store import SurfaceStore

if TYPE_CHECKING:
    from obstore.store import RetryConfig

BUCKETS = ("s3", "gs", "az")
"""Schemes of buckets: Amazon S3 and compatible services, Google, Azure."""

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")

# A client waits for the response, so retries end early. (The connection options of obstore stay
# unset: if one option is set, obstore ignores all of them in the environment.)
_RETRIES: "RetryConfig" = {"max_retries": 3, "retry_timeout": timedelta(seconds=30)}


def open_store(address: str, quota: int) -> SurfaceStore:
    """Opens the store at an address.

    Parameters
    ----------
    address : str
        A folder, or `file:///folder`, which is made if it does not exist; `memory://`, whose
        content is lost at the end of the process; or a bucket, `s3://bucket/prefix`, whose region,
        keys and endpoint are in the environment (AWS_REGION, AWS_ACCESS_KEY_ID, …).
    quota : int
        Bytes that all objects may take together; 0 sets no limit.

    Raises
    ------
    InvalidSettings
        The address names no store, or the service cannot write to the store.
    """
    scheme = _SCHEME.match(address)
    if scheme is None:
        return SurfaceStore(_open_folder(Path(address)), quota)
    name = scheme[1].lower()
    if name == "file":
        return SurfaceStore(_open_folder(_path_of(address)), quota)
    if name == "memory":
        if urlsplit(address)[1:] != ("", "", "", ""):
            raise InvalidSettings(f"SURFACE_STORE: got {address!r}, needed memory:// alone.")
        return SurfaceStore(Bucket(MemoryStore()), quota)
    if name in BUCKETS:
        return SurfaceStore(_open_bucket(address), quota)
    schemes = ", ".join(f"{scheme}://" for scheme in ("file", "memory", *BUCKETS))
    needed = f"a folder, or an address that begins with {schemes}"
    raise InvalidSettings(f"SURFACE_STORE: got {address!r}, needed {needed}.")


def _path_of(address: str) -> Path:
    """The folder of a `file://` URL (RFC 8089)."""
    parts = urlsplit(address)
    path = unquote(parts.path)
    if parts.netloc not in ("", "localhost") or not path.startswith("/") or parts.query:
        raise InvalidSettings(
            f"SURFACE_STORE: got {address!r}, needed file:// and the whole path of a folder."
        )
    return Path(path)


def _open_folder(path: Path) -> Folder:
    """The backend of a folder; first makes a file in it, as a test."""
    try:
        root = path.expanduser().absolute()
        for name in (SURFACES, STAGING):
            make_folder(root / name)
        with tempfile.TemporaryFile(dir=root / STAGING):
            pass
    except OSError as error:
        # If only the disk is full, the service still serves the stored surfaces.
        if error.errno not in DISK_FULL or not (root / STAGING).is_dir():
            raise InvalidSettings(
                f"SURFACE_STORE: surfaces cannot be kept in the folder {str(path)!r}: "
                f"{reason_of(error)}."
            ) from None
    except (RuntimeError, ValueError) as error:  # no home folder, or a null character in the path
        raise InvalidSettings(
            f"SURFACE_STORE: got {str(path)!r}, needed a folder: {error}."
        ) from None
    return Folder(LocalStore(root), root, CapacityLimiter(1))


def _open_bucket(address: str) -> Bucket:
    """The backend of a bucket; the first use shows whether it can be reached."""
    try:
        return Bucket(from_url(address, retry_config=_RETRIES))
    except (BaseError, ValueError, TypeError) as error:
        reason = str(error).partition("\n")[0]
        raise InvalidSettings(
            f"SURFACE_STORE: got {address!r}, needed the address of a bucket: {reason}."
        ) from None
