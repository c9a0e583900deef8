"""The limits of documents, files and results that the settings give."""

from service.decoders.format import FileLimits
from service.pipeline.brep_cost import FACE_SECONDS
from service.pipeline.limits import Limits
from service.schemas.document import MEMBERS_FACTOR, DocumentLimits
from service.settings.values import Settings

REQUEST_SHARE = 11 / 16
"""The part of the memory that one request may work in, beside its body. All bodies have 4/16, and
the event loop has 1/16 (`service.api.threads`)."""


def document_limits(settings: Settings) -> DocumentLimits:
    """The limits of a request's document."""
    return DocumentLimits(
        settings.max_control_points,
        settings.max_degree,
        settings.max_json_depth,
        settings.max_json_values,
        settings.max_faces,
        settings.max_members,
    )


def file_limits(settings: Settings) -> FileLimits:
    """The limits of what a file may hold."""
    return FileLimits(
        settings.max_control_points,
        settings.max_file_entities,
        settings.max_faces,
        settings.max_placed_faces,
        settings.max_members,
        settings.max_members * MEMBERS_FACTOR,
    )


def result_limits(settings: Settings) -> Limits:
    """The limits of results: vertices, points, patches, bytes, memory, and faces by time."""
    return Limits(
        settings.max_vertices,
        settings.max_response_bytes,
        settings.max_points,
        max_patches=settings.max_patches,
        max_memory=int(settings.memory_bytes * REQUEST_SHARE),
        max_mesh_faces=int(settings.request_timeout / FACE_SECONDS),
        max_placed_faces=settings.max_placed_faces,
    )
