"""The route for the state of a job as a stream of events."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator

from fastapi import APIRouter, Depends, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.api.job_documents import describe_state
from service.api.negotiation import refuse_parameters
from service.api.openapi.jobs import JOB_ERRORS
from service.api.record import record_of
from service.api.routes.job_state import StateDep, find_jobs
from service.api.services import ContextDep
from service.errors import SurfaceError
from service.jobs.state import JobState

RETRY = 1000
"""Milliseconds after which an `EventSource` connects again when a stream of events has ended."""

DRAIN_CHECK = 0.5
"""Seconds between two looks whether the service is about to stop, while a stream waits."""


events = APIRouter()


async def refuse_query(request: Request) -> None:
    """Refuses all parameters; a dependency of the route that responds with a stream."""
    refuse_parameters(request.query_params)


@events.get(
    "/v1/jobs/{id}/events",
    operation_id="getJobEvents",
    tags=["jobs"],
    summary="The state of a job as a stream of events",
    response_class=EventSourceResponse,
    response_description="Events `progress`, and at the end of the job one event `end`.",
    responses=JOB_ERRORS,
    dependencies=[Depends(refuse_query)],
)
async def get_job_events(
    state: StateDep, request: Request, context: ContextDep
) -> AsyncIterator[ServerSentEvent]:
    """Sends the state of the job now, and then each change, at most two a second.

    The data of each event `progress`, and of the last event, `end`, is the document of
    `GET /v1/jobs/{id}`. Between events, a comment every 15 s keeps the connection open. Before the
    service stops it ends the stream; an `EventSource` then connects again after a second.
    """
    root = request.scope.get("root_path", "")

    def event(state: JobState) -> ServerSentEvent:
        name = "end" if state.has_ended else "progress"
        return ServerSentEvent(data=describe_state(state, root), event=name, retry=RETRY)

    yield event(state)
    if state.has_ended or record_of(request.scope).method == "HEAD":
        return
    async for change in _until_draining(find_jobs(context).watch(state.id), request):
        if change != state:
            yield event(change)


async def _until_draining(
    states: AsyncIterator[JobState], request: Request
) -> AsyncGenerator[JobState]:
    """The states, until the service is about to stop, or the store fails."""
    upcoming: asyncio.Task[JobState | None] | None = None
    try:
        while request.app.state.ready:
            upcoming = upcoming or asyncio.create_task(_next(states))
            if not (await asyncio.wait({upcoming}, timeout=DRAIN_CHECK))[0]:
                continue
            try:
                state = upcoming.result()
            except SurfaceError:  # the store fails; the client connects again, and gets the error
                return
            if state is None:
                return
            upcoming = None
            yield state
    finally:
        if upcoming is not None:
            upcoming.cancel()


async def _next(states: AsyncIterator[JobState]) -> JobState | None:
    """The next state; None at the end."""
    return await anext(states, None)
