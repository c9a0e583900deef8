"""By what the editor knows files: their beginnings and suffixes, and the limits of the service."""

import re
from typing import Any

from service.decoders.mesh_registry import MESH_BEGINNINGS, MESH_DECODERS
from service.decoders.refused import REFUSED
from service.decoders.registry import BEGINNINGS, DECODERS
from service.settings.values import Settings

TEAPOT_SUFFIX = "txt"
"""Files of the teapot often have this suffix, which other texts have, too."""


def describe_files(settings: Settings) -> dict[str, Any]:
    """The formats that the service reads, those that it does not and why, and the limits.

    `meshes` are those of `POST /v1/check`.
    """
    read = [
        {
            "media_type": decoder.media_type,
            "suffixes": [*decoder.suffixes, *[TEAPOT_SUFFIX] * (decoder.name == "teapot")],
            "beginning": _pattern(BEGINNINGS.get(decoder.name)),
        }
        for decoder in DECODERS
    ]
    refused = [
        {
            "suffixes": each.suffixes,
            "beginning": _pattern(each.beginning),
            "issue": {"code": issue.code, "detail": issue.message, "needed": issue.needed},
        }
        for each in REFUSED
        for issue in (each.issue(),)
    ]
    limits = {
        "max_bytes": settings.max_body_bytes,
        "max_json_bytes": min(settings.max_json_bytes, settings.max_body_bytes),
    }
    meshes = [
        {
            "format": decoder.name,
            "suffixes": decoder.suffixes,
            "beginning": _pattern(MESH_BEGINNINGS.get(decoder.name)),
        }
        for decoder in MESH_DECODERS
    ]
    return {"read": read, "meshes": meshes, "refused": refused} | limits


def _pattern(beginning: re.Pattern[bytes] | None) -> str | None:
    """The source of a pattern of the first bytes, for texts of Latin-1."""
    return None if beginning is None else beginning.pattern.decode("latin-1")
