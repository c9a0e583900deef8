"""The work of reading a file, and what it costs."""

from functools import partial

from service.decoders.child import read_file
from service.decoders.format import Decoded, Decoder, FileLimits
from service.pipeline.cost import Cost, Work
from service.pipeline.limits import Limits

BYTE_SECONDS, START_SECONDS = 5e-7, 0.1
"""Time to read one byte of a CAD file, and to start the process that reads it."""


def plan_reading(
    decoder: Decoder, content: bytes, kind: str | None, file_limits: FileLimits, limits: Limits
) -> Work[Decoded]:
    """The work of reading a file; longer CAD files are read in a child process.

    The values of the document are not checked yet.

    Raises
    ------
    TooLarge
        No request may take the memory that a file of this length needs.
    """
    length = len(content)
    memory = decoder.memory(length)
    instead = "a shorter file, or more memory (SURFACE_MEMORY_BYTES)"
    limits.check_memory(memory, "To read a file of this length", "", instead)
    start = START_SECONDS if decoder.is_read_in_child(length) else 0.0
    cost = Cost(memory, start + BYTE_SECONDS * length)
    return Work(cost, partial(read_file, decoder, content, kind, file_limits))
