"""POST /v1/estimate: what a mesh would be, before it is made."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import HEADERS, ChunkedResponse
from service.api.posted import Posting, posting
from service.api.timing import Timing
from service.api.work import Pace, Task, done, parsed
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.encoders.text import json_text
from service.pipeline.encoding import encode_options
from service.pipeline.estimate import estimate, estimate_object
from service.pipeline.memory import estimating
from service.schemas.options import MeshOptionFields
from service.schemas.request import MeshRequest
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface
from service.surface.group import GroupSurface

INLINE_MEMORY = 1 << 22
"""What takes no more memory is estimated in a millisecond or two."""


async def post_estimate(request: Request) -> Response:
    """The surface and the options as for a mesh; a format in the query, or all."""
    settings: Settings = request.app.state.settings
    posted = posting(request, FORMATS)
    timing = Timing()
    with timing.step("read"):
        body = await posted.read(request, settings)
    formats = FORMATS if posted.format is None else (posted.format,)
    async with attended(request):
        is_long = posted.is_long(body)
        parse = partial(_parse, posted, body, settings)
        surface, wanted = await parsed(parse, timing, is_long=is_long)
        del body, parse
        work = _Estimate(surface, wanted, formats, settings)
        task = Task("estimate", lambda: work, 0, _pace, is_long)
        _, content = await done(task, _Estimate.run, len, timing)
    headers = HEADERS | {"Server-Timing": str(timing)}
    return ChunkedResponse(content, 200, headers, "application/json")


@dataclass(frozen=True, slots=True)
class _Estimate:
    """An estimate to be made, in some formats."""

    surface: Surface
    wanted: MeshOptionFields
    formats: Sequence[Format]
    settings: Settings

    @property
    def memory(self) -> int:
        """Bytes that it takes at most."""
        return estimating(self.surface)

    def run(self) -> bytes:
        """The estimate as JSON."""
        options, encode = self.wanted.mesh_options(), encode_options(self.wanted)
        found = estimate(self.surface, options, encode, result_limits(self.settings), self.formats)
        return json_text(estimate_object(found))


def _parse(
    posted: Posting[Format], body: bytes, settings: Settings
) -> tuple[Surface, MeshOptionFields]:
    """What a body asks for."""
    wanted = posted.request(MeshRequest, body, document_limits(settings))
    return wanted.to_surface(), wanted


def _pace(work: _Estimate) -> Pace:
    """How long an estimate takes."""
    if work.wanted.mesh_options().accuracy is not None:
        return Pace.LONG  # nobody knows
    # Every member of a group takes a millisecond of its own.
    is_small = work.memory <= INLINE_MEMORY and not isinstance(work.surface, GroupSurface)
    return Pace.AT_ONCE if is_small else Pace.SOON
