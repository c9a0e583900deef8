"""The limits of the parts of jobs: more work than a request may do, and half of its memory."""

from dataclasses import replace

from service.pipeline.calls import CallLimits
from service.settings.limits import document_limits, file_limits, result_limits
from service.settings.values import Settings


def part_limits(settings: Settings) -> CallLimits:
    """The limits of a part.

    A part may take as many multiplications and faces more than a request as it has time more. All
    batches together may take half of the memory of requests, so one part may not take more.
    """
    limits = result_limits(settings)
    factor = max(1.0, settings.job_part_timeout / settings.request_timeout)
    return CallLimits(
        document_limits(settings),
        replace(
            limits,
            max_multiplications=int(limits.max_multiplications * factor),
            max_memory=limits.max_memory // 2,
            max_mesh_faces=int(limits.max_mesh_faces * factor),
        ),
        file_limits(settings),
    )
