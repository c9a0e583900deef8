"""The error of one entity of a file: it is reported, and the file is read on."""

from service.decoders.cad.faults import InvalidGeometry


class Fault(InvalidGeometry):
    """An entity cannot be read; the reason is a plain phrase that may name entities by number."""
