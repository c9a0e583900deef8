"""The refusal of what does not fit right now."""

from service.errors import SurfaceError


class Busy(SurfaceError):
    """Others take all the room there is, right now."""
