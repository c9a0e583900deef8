"""The manifest of a job: which parts it has, and in which batches they are computed."""

from bisect import bisect_right
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

import orjson

FORM = 1
"""The version of the form of manifests."""


class Batch(NamedTuple):
    """Parts that are computed in one task.

    Attributes
    ----------
    first : int
        The index of its first part.
    parts : int
        The number of its parts.
    memory : int
        The most bytes that one of its parts takes.
    """

    first: int
    parts: int
    memory: int


@dataclass(frozen=True, slots=True)
class Manifest:
    """The content of a job; written once, when it is accepted.

    Attributes
    ----------
    id : str
    engine : int
        The version of the numbers that it is computed with.
    created : datetime
    folder : str
        The folder in `intake/` that has the lines of the parts, one object a batch.
    batches : tuple of Batch
    """

    id: str
    engine: int
    created: datetime
    folder: str
    batches: tuple[Batch, ...]

    @property
    def total(self) -> int:
        """The number of all parts."""
        last = self.batches[-1]
        return last.first + last.parts

    def batch_of(self, part: int) -> int:
        """The number of the batch that has this part."""
        return bisect_right(self.batches, part, key=lambda batch: batch.first) - 1

    def encode(self) -> bytes:
        """The manifest as JSON, for the store."""
        return orjson.dumps(
            {
                "job": FORM,
                "id": self.id,
                "engine": self.engine,
                "created": self.created,
                "folder": self.folder,
                "batches": list(map(list, self.batches)),
            }
        )


def decode_manifest(content: bytes) -> Manifest:
    """The manifest that `Manifest.encode` wrote."""
    values = orjson.loads(content)
    return Manifest(
        values["id"],
        values["engine"],
        datetime.fromisoformat(values["created"]),
        values["folder"],
        tuple(map(Batch._make, values["batches"])),
    )
