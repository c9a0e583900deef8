"""The number of calls of functions outside the mathematics, during a request for a small mesh."""

from tools.request_profile import count_calls, exclude_mathematics


def test_a_request_for_a_small_mesh_needs_few_calls_in_few_files() -> None:
    # When last measured: 139 calls in 34 files, two of them for turns between callers, two that ask
    # whether the client accepts a coding, six that
    # breps have added (options, headers, the memory of a document), one for planar control points,
    # two for homogeneous ones, and two for more places at which work can be cancelled; the first
    # line of the log in a second takes one more. The limits keep changes from adding calls.
    calls = exclude_mathematics(count_calls("glb"))
    assert calls.total() <= 140
    assert len(calls) <= 34, sorted(calls)
