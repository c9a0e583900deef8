"""Where the time of one request goes: the teapot posted as JSON, answered as GLB."""

import asyncio
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial

import orjson
from starlette.types import ASGIApp, Message

from service.api.app import create_app
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.evaluation.evaluate import evaluate
from service.engine.layout import Layout
from service.engine.options import MeshOptions
from service.engine.scratch import Real
from service.engine.tessellate import tessellate
from service.pipeline.mesh import plan
from service.schemas.document import parse_document
from service.schemas.request import MeshRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.settings.process import pin_blas
from service.settings.values import Settings, document_limits
from service.surface.examples import find
from tests.examples import patches_of
from tools.benchmarks.alternately import alternately

HEADERS = {"content-type": "application/json", "accept": "model/gltf-binary"}


async def answered(app: ASGIApp, body: bytes) -> bytes:
    """The answer to POST /v1/mesh, as a server would ask for it."""
    scope: dict[str, object] = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": "POST",
        "scheme": "http",
        "path": "/v1/mesh",
        "raw_path": b"/v1/mesh",
        "query_string": b"",
        "headers": [(name.encode(), value.encode()) for name, value in HEADERS.items()],
    }
    chunks: list[bytes] = []

    async def receive() -> Message:
        return {"type": "http.request", "body": body, "more_body": False}

    async def send(message: Message) -> None:
        chunks.append(message.get("body", b""))

    await app(scope, receive, send)
    return b"".join(chunks)


def run() -> None:
    """Prints each step, and the whole request through the application without a network."""
    surface, options, glb = find("utah-teapot").surface(), MeshOptions(), BY_NAME["glb"]
    body = orjson.dumps(
        {"surface": definition(surface), "resolution": 16}, option=orjson.OPT_SERIALIZE_NUMPY
    )
    document = parse_document(body)
    limits = document_limits(Settings())
    model = patches_of("utah-teapot")
    made = tessellate(model, options, single=True)
    single: Real = made.positions.dtype.type
    steps: dict[str, Callable[[], object]] = {
        "parse the JSON": partial(parse_document, body),
        "check it and make arrays": lambda: validate_document(
            MeshRequest, document, limits
        ).to_surface(),
        "plan: lower, predict, refuse": partial(plan, surface, options, glb),
        "  find shared edges": partial(Layout.plan, model, options.resolution),
        "  evaluate": partial(evaluate, model.batches[0], options.resolution, dtype=single),
        "tessellate (both and welding)": partial(tessellate, model, options, single=True),
        "encode": lambda: glb.encode(made, EncodeOptions()),
    }
    app = create_app(Settings())
    with closing(asyncio.new_event_loop()) as loop:
        steps["the whole request"] = lambda: loop.run_until_complete(answered(app, body))
        answer = loop.run_until_complete(answered(app, body))
        times = alternately(steps, rounds=9, clock=time.process_time)
    print(f"The teapot at 16 divisions: {len(body)} bytes in, {len(answer)} bytes of GLB out")
    print(f"{'step':38}{'µs':>10}")
    for title, seconds in times.items():
        print(f"{title:38}{seconds * 1e6:10.0f}")


if __name__ == "__main__":
    pin_blas()
    run()
