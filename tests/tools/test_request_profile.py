"""How much of the service runs for one small mesh, outside the mathematics."""

from tools.request_profile import outside, profile


def test_a_small_mesh_takes_few_calls_in_few_files() -> None:
    calls = outside(profile("glb"))
    assert calls.total() <= 124
    assert len(calls) <= 26, sorted(calls)
