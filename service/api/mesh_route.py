"""A route whose body is JSON with a surface and a mesh, or a file with the mesh.

With a file, the query names a surface by its id, and has the options: `?surface=sphere`.
"""

from base64 import b64encode
from functools import partial
from typing import Any

import orjson
from fastapi import Response

from service.api.body import BodyRoute, PostedFile
from service.api.computation import Computation
from service.api.intake import accept_call
from service.api.named_surface import check_named, load_named, parse_named
from service.api.negotiation import Pairs
from service.api.services import Context, Services
from service.decoders.format import Decoder
from service.decoders.mesh_registry import MESH_DECODERS
from service.encoders.text import json_text
from service.schemas.fields import RequestModel
from service.schemas.query import values_from_text
from service.schemas.surfaces import definition
from service.surface.kinds import Surface


class MeshRoute(BodyRoute):
    """A route that reads the whole document as JSON, or its mesh as a file."""

    decoders = MESH_DECODERS

    def read_fields(self, pairs: Pairs, decoder: Decoder) -> dict[str, Any]:
        """The fields in the query of a file, which names a surface."""
        del decoder
        values = values_from_text(pairs)
        check_named(values, "mesh", "the mesh")
        return values

    async def accept_job(
        self, model: type[RequestModel], file: PostedFile, context: Context
    ) -> Response | None:
        """Makes a job of a mesh file: a part with a JSON body, unless that would be too long."""
        del model  # the part is checked as that of a job
        services, computation, *_ = context
        surface = await load_named(services, computation, file.beside["surface"])
        write = partial(_write_document, file, surface, services.settings.max_json_bytes)
        document = await computation.parse(write, is_long=True)
        if document is None:
            return None
        return await accept_call(context, self.path, document)

    async def _read_file(
        self,
        model: type[RequestModel],
        file: PostedFile,
        services: Services,
        computation: Computation,
    ) -> RequestModel:
        """The model of a file, with the surface of the query, which is loaded."""
        content, decoder, _ = file

        def read_mesh() -> dict[str, Any]:
            return {"mesh": {"file": content, "format": decoder.name}}

        return await parse_named(model, file, services, computation, read_mesh, is_long=True)


def _write_document(file: PostedFile, surface: Surface, max_bytes: int) -> dict[str, Any] | None:
    """The JSON document of a mesh file, with the surface itself; None if it exceeds `max_bytes`."""
    if 4 * len(file.content) > 3 * max_bytes:
        return None
    text = json_text(definition(surface))
    if len(text) + 4 * len(file.content) // 3 > max_bytes:
        return None
    mesh = {"file": b64encode(file.content).decode(), "format": file.decoder.name}
    return {**file.beside, "surface": orjson.loads(text), "mesh": mesh}
