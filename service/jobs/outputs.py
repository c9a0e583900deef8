"""Where a batch finds the files that its parts read, and writes the files that it makes.

Jobs have both in the store, under ids. A bake has them on its machines, under names.
"""

import time
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from typing import Any, Protocol

from service.decoders.format import Decoder
from service.errors import DamagedObject
from service.jobs.file_parts import decoder_of, read_local_file, unknown_file
from service.jobs.keys import file_key, part_key
from service.jobs.results import Result, read_object, write_object
from service.storage.backends import Backend

Line = dict[str, Any]
"""A part in the form of `check_part`, with its index `part`."""


class Output(Protocol):
    """Where the files of a batch are written."""

    async def find(self, line: Line) -> Result | None:
        """The result of a part whose file is there; None if it must be computed."""

    async def write(self, line: Line, result: Result, content: bytes) -> Result:
        """Writes the file of a part; returns the result that stays."""

    async def read_source(self, name: str) -> tuple[Decoder, bytes]:
        """The file that has the surface of a part, by the `file` of its line.

        Raises
        ------
        InvalidRequest
            There is no such file.
        """


@dataclass(frozen=True, slots=True)
class StoredParts:
    """Files in the store, under the ids of the parts, for all jobs."""

    backend: Backend
    lifetime: float

    async def find(self, line: Line) -> Result | None:
        """The result of a part whose file is there; None if it must be computed."""
        key = part_key(line["id"])
        try:
            entry = await self.backend.head(key)
            stored = await self.backend.read(key)
            result, _ = read_object(stored)
        except (FileNotFoundError, DamagedObject):
            return None
        if time.time() - entry.modified > self.lifetime / 2:
            await self.backend.write(key, stored, durable=False)
        return result

    async def write(self, line: Line, result: Result, content: bytes) -> Result:
        """Writes the file of a part; returns the result that stays."""
        # Another process may have been faster. Its file stays: on another processor the last digit
        # of a number may differ, and clients may have the file already.
        if (first := await self.find(line)) is not None:
            return first
        await self.backend.write(part_key(line["id"]), write_object(result, content), durable=False)
        return result

    async def read_source(self, name: str) -> tuple[Decoder, bytes]:
        """The file that has the surface of a part, by the `file` of its line."""
        try:
            content = await self.backend.read(file_key(name))
        except FileNotFoundError:
            raise unknown_file() from None
        if sha256(content).hexdigest() != name.partition(".")[0]:
            raise DamagedObject
        return decoder_of(name), content


@dataclass(frozen=True, slots=True)
class NamedFiles:
    """Files with the names of the parts, in a folder or a bucket.

    A line has in `known` the record of an earlier run, if there is one.
    """

    backend: Backend

    async def find(self, line: Line) -> Result | None:
        """The result of a part whose file is there; None if it must be computed."""
        known = line.get("known")
        if known is None or known["id"] != line["id"]:
            return None
        result = Result(**known["result"])
        with suppress(FileNotFoundError):
            content = await self.backend.read(_file_key(line, result))
            if sha256(content).hexdigest() == result.sha256:
                return result
        return None

    async def write(self, line: Line, result: Result, content: bytes) -> Result:
        """Writes the file of a part; returns the result that stays."""
        await self.backend.write(_file_key(line, result), content, durable=False)
        return result

    async def read_source(self, name: str) -> tuple[Decoder, bytes]:
        """The file that has the surface of a part, by the `file` of its line."""
        return read_local_file(name)


def _file_key(line: Line, result: Result) -> str:
    return f"{line['name']}.{result.suffix}"
