"""Limits of the parts of jobs follow from the settings of requests and of jobs."""

from service.jobs.limits import part_limits
from service.settings.limits import document_limits, result_limits
from service.settings.values import Settings


def test_a_part_may_take_more_time_and_less_memory_than_a_request() -> None:
    settings = Settings(request_timeout=60, job_part_timeout=3600, memory_bytes=1 << 30)
    limits, request_limits = part_limits(settings), result_limits(settings)
    assert limits.document == document_limits(settings)
    assert limits.result.max_multiplications == 60 * request_limits.max_multiplications
    assert limits.result.max_mesh_faces == 60 * request_limits.max_mesh_faces
    assert limits.result.max_memory == request_limits.max_memory // 2
    assert limits.result.max_bytes == request_limits.max_bytes


def test_a_part_never_may_take_less_time_than_a_request() -> None:
    settings = Settings(request_timeout=60, job_part_timeout=1)
    expected = result_limits(settings).max_multiplications
    assert part_limits(settings).result.max_multiplications == expected
