"""Opens the store that the setting SURFACE_STORE names."""

import logging
import re
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from obstore.exceptions import BaseError
from obstore.store import LocalStore, MemoryStore, from_url

from service.errors import InvalidSettings
from service.storage.backends import Bucket
from service.storage.failures import DISK_FULL, READ_ONLY, reason_of
from service.storage.files import has_folder, make_folder, open_folder
from service.storage.folder import STAGING, Folder
from service.storage.keys import SURFACES
from service.storage.marker import read_marker, write_marker
from service.storage.store import SurfaceStore

if TYPE_CHECKING:
    from obstore.store import RetryConfig

BUCKETS = ("s3", "gs", "az")
"""Schemes of buckets: Amazon S3 and compatible services, Google, Azure."""

_STORE, _OUTPUT = "SURFACE_STORE", "--output"
"""The setting that has the address of the store, and the flag that has that of an output."""

_log = logging.getLogger(__name__)

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")

# A client waits for the response, so retries end early. (The connection options of obstore stay
# unset: if one option is set, obstore ignores all of them in the environment.)
_RETRIES: "RetryConfig" = {"max_retries": 3, "retry_timeout": timedelta(seconds=30)}


def open_store(address: str, quota: int, create: bool = True) -> SurfaceStore:
    """Opens the store at an address.

    Parameters
    ----------
    address : str
        A folder, or `file:///folder`; `memory://`, whose
        content is lost at the end of the process; or a bucket, `s3://bucket/prefix`, whose region,
        keys and endpoint are in the environment (AWS_REGION, AWS_ACCESS_KEY_ID, …).
    quota : int
        Bytes that all objects may take together; 0 sets no limit.
    create : bool
        Whether to make a store in a folder that is none, or does not exist.

    Raises
    ------
    InvalidSettings
        The address names no store, or a new store cannot be made.
    """
    scheme = _SCHEME.match(address)
    if scheme is None:
        return SurfaceStore(_open_folder(Path(address), create), quota)
    name = scheme[1].lower()
    if name == "file":
        return SurfaceStore(_open_folder(_path_of(address), create), quota)
    if name == "memory":
        if urlsplit(address)[1:] != ("", "", "", ""):
            raise InvalidSettings(f"SURFACE_STORE: got {address!r}, needed memory:// alone.")
        return SurfaceStore(Bucket(MemoryStore()), quota)
    if name in BUCKETS:
        return SurfaceStore(_open_bucket(address), quota)
    schemes = ", ".join(f"{scheme}://" for scheme in ("file", "memory", *BUCKETS))
    needed = f"a folder, or an address that begins with {schemes}"
    raise InvalidSettings(f"SURFACE_STORE: got {address!r}, needed {needed}.")


def _path_of(address: str, setting: str = _STORE) -> Path:
    """The folder of a `file://` URL (RFC 8089); errors name the setting."""
    parts = urlsplit(address)
    path = unquote(parts.path)
    if parts.netloc not in ("", "localhost") or not path.startswith("/") or parts.query:
        raise InvalidSettings(
            f"{setting}: got {address!r}, needed file:// and the whole path of a folder."
        )
    return Path(path)


def _open_folder(path: Path, create: bool) -> Folder:
    """The backend of a folder; makes and marks a new store, and marks one without a marker."""
    root = _absolute_path(path)
    try:
        if root.exists():
            with open_folder(root) as folder:
                if id := read_marker(folder):
                    return Folder(root, id)
                if has_folder(folder, SURFACES):
                    return Folder(root, _mark_older_store(folder, root))
        if create:
            return Folder(root, _make_store(root))
    except OSError as error:
        raise InvalidSettings(
            f"SURFACE_STORE: surfaces cannot be kept in the folder {str(root)!r}: "
            f"{reason_of(error)}."
        ) from None
    raise InvalidSettings(
        f"SURFACE_STORE: there is no store in {str(root)!r}, and none may be made now. Perhaps its "
        "disk is not mounted."
    )


def _absolute_path(path: Path, setting: str = _STORE) -> Path:
    """The absolute path of a folder, which may begin with `~`; errors name the setting."""
    try:
        if "\0" in str(path):
            raise ValueError("a path has no null characters")
        return path.expanduser().absolute()
    except (RuntimeError, ValueError) as error:  # RuntimeError: there is no such home folder
        raise InvalidSettings(f"{setting}: got {str(path)!r}, needed a folder: {error}.") from None


def _make_store(root: Path) -> str:
    """Makes a store in a folder that may not exist yet; returns its id."""
    for name in (SURFACES, STAGING):
        make_folder(root / name)
    with open_folder(root) as folder:
        id = write_marker(folder)
    _log.info("made a new store in %s", root)
    return id


def _mark_older_store(folder: int, root: Path) -> str | None:
    """The id of a store of version 0.1.0, which gets its marker; None if it cannot be written."""
    try:
        return write_marker(folder)
    except OSError as error:
        if error.errno not in READ_ONLY | DISK_FULL:
            raise
        _log.warning(
            "the store in %s has no marker yet and gets none (%s); it is served as it is",
            root,
            reason_of(error),
        )
        return None


def open_output(address: str) -> Bucket:
    """The folder or the bucket for files of a user; the folder is made if it does not exist.

    It gets no marker, because it is no store; and its files are not forced to the disk.

    Raises
    ------
    InvalidSettings
        The address names neither.
    """
    scheme = _SCHEME.match(address)
    name = "" if scheme is None else scheme[1].lower()
    if name in BUCKETS:
        return _open_bucket(address, _OUTPUT)
    if "://" in address and name != "file":
        schemes = ", ".join(f"{each}://" for each in ("file", *BUCKETS))
        needed = f"a folder, or an address that begins with {schemes}"
        raise InvalidSettings(f"{_OUTPUT}: got {address!r}, needed {needed}.")
    path = _path_of(address, _OUTPUT) if name == "file" else Path(address)
    try:
        return Bucket(LocalStore(_absolute_path(path, _OUTPUT), mkdir=True))
    except (BaseError, OSError):
        needed = "a folder, or a name with which a folder can be made"
        raise InvalidSettings(f"{_OUTPUT}: got {address!r}, needed {needed}.") from None


def _open_bucket(address: str, setting: str = _STORE) -> Bucket:
    """The backend of a bucket; the first use shows whether it can be reached."""
    try:
        return Bucket(from_url(address, retry_config=_RETRIES))
    except (BaseError, ValueError, TypeError) as error:
        reason = str(error).partition("\n")[0]
        raise InvalidSettings(
            f"{setting}: got {address!r}, needed the address of a bucket: {reason}."
        ) from None
