"""The job that the path of a request names: a dependency of the routes about one job."""

from typing import Annotated, TypeAlias

from fastapi import Depends

from service.api.openapi.jobs import JobId
from service.api.services import Context, ContextDep
from service.errors import StoreFailed
from service.jobs.manager import Jobs
from service.jobs.reading import unknown_job
from service.jobs.state import JobState
from service.storage.keys import is_id


def find_jobs(context: Context) -> Jobs:
    """The jobs of the application.

    Raises
    ------
    StoreFailed
        There is no place to keep jobs.
    """
    jobs = context.services.jobs
    if jobs is None:
        raise StoreFailed
    return jobs


async def find_state(id: JobId, context: ContextDep) -> JobState:
    """The state of the job that the path names.

    Raises
    ------
    UnknownJob
    """
    if not is_id(id):
        raise unknown_job()
    return await find_jobs(context).state(id)


StateDep: TypeAlias = Annotated[JobState, Depends(find_state)]
