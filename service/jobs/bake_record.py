"""The record of a bake: which part each file of the output is, and the hash of the file.

    .surface-bake/<time>-<random>.ndjson    lines of JSON: name, id of the part, and its `Result`

About once a second the record gets one more file, in a folder as in a bucket. So no write can
damage an earlier one, and several bakes may write into one output. What must be at hand however
long a list is, stands in a temporary database: names so far, known files, failures.
"""

import sqlite3
import time
import unicodedata
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import orjson

from service.storage.backends import Backend
from service.storage.failures import translate_errors

FOLDER = ".surface-bake"
"""The folder of the record in the output. Names of parts do not begin with a point."""

_TABLES = """
CREATE TABLE names (name TEXT PRIMARY KEY, place TEXT) WITHOUT ROWID;
CREATE TABLE known (name TEXT PRIMARY KEY, file BLOB) WITHOUT ROWID;
CREATE TABLE failures (number INTEGER PRIMARY KEY, place TEXT, name TEXT, error BLOB);
"""


@dataclass(frozen=True, slots=True)
class Failure:
    """A part that failed: its place in the list, its name, its error as JSON (`write_error`)."""

    place: str
    name: str
    error: dict[str, Any]


class BakeRecord:
    """The record of an output; all methods run in one thread."""

    def __init__(self, output: Backend) -> None:
        self._output = output
        self._database = sqlite3.connect("")  # a temporary file, which the system removes
        self._database.executescript(_TABLES)
        self._new: list[bytes] = []

    async def load(self) -> None:
        """Reads what earlier bakes have recorded; of two records of a name, the later counts.

        Raises
        ------
        StoreFailed
        """
        with translate_errors("reading the record of the output"):
            async for page in self._output.list(FOLDER):
                for entry in page:
                    self._keep(await self._output.read(entry.key))

    def _keep(self, content: bytes) -> None:
        for line in content.splitlines():
            # A power failure may have torn a line: its part is then made again.
            with suppress(ValueError, KeyError, TypeError):
                known = orjson.loads(line)
                name, id, result = known["name"], known["id"], known["result"]
                if isinstance(name, str) and isinstance(id, str) and isinstance(result, dict):
                    self._set_known(name, line)

    def _set_known(self, name: str, line: bytes) -> None:
        self._database.execute("INSERT OR REPLACE INTO known VALUES (?, ?)", (name, line))

    def find_known(self, name: str) -> dict[str, Any] | None:
        """The recorded file of this name, with its `id` and `result`; None if there is none."""
        row = self._database.execute("SELECT file FROM known WHERE name = ?", (name,)).fetchone()
        return None if row is None else dict(orjson.loads(row[0]))

    def take_name(self, name: str, place: str) -> str | None:
        """Notes that a name occurs at a place; returns the place where it occurred before, if any.

        Names that differ only in upper and lower case are one name, as in folders of macOS and
        Windows.
        """
        key = unicodedata.normalize("NFC", name.casefold())
        values = (key, place)
        if self._database.execute("INSERT OR IGNORE INTO names VALUES (?, ?)", values).rowcount:
            return None
        row = self._database.execute("SELECT place FROM names WHERE name = ?", (key,)).fetchone()
        return str(row[0])

    def add(self, name: str, id: str, result: dict[str, Any]) -> None:
        """Records a new file; `result` has the fields of `Result`."""
        self._new.append(orjson.dumps({"name": name, "id": id, "result": result}))

    async def write(self) -> None:
        """Writes what was added since the last call that succeeded.

        Raises
        ------
        StoreFull, StoreFailed
        """
        count = len(self._new)
        if count:
            key = f"{FOLDER}/{time.time_ns():020}-{uuid4().hex[:8]}.ndjson"
            with translate_errors("writing the record of the output"):
                lines = b"\n".join((*self._new, b""))
                await self._output.write(key, lines, durable=False)
            del self._new[:count]

    def add_failure(self, number: int, failure: Failure) -> None:
        """Notes a failure; `number` is that of the part in the list."""
        values = (number, failure.place, failure.name, orjson.dumps(failure.error))
        self._database.execute("INSERT INTO failures VALUES (?, ?, ?, ?)", values)

    def failures(self) -> Iterator[Failure]:
        """All failures, in the order of the list."""
        rows = self._database.execute("SELECT place, name, error FROM failures ORDER BY number")
        for place, name, error in rows:
            yield Failure(place, name, orjson.loads(error))
