"""The cost of reading a file is known before it is read."""

from dataclasses import replace

import numpy as np
import pytest

from service.decoders.format import FileLimits
from service.decoders.registry import BY_NAME
from service.errors import TooLarge
from service.pipeline.limits import Limits
from service.pipeline.reading import plan_reading

STEP = BY_NAME["step"]


def test_work_reads_the_file() -> None:
    content = b"2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n"
    work = plan_reading(BY_NAME["teapot"], content, None, FileLimits(), Limits())
    decoded = work.run()
    assert decoded.reading is None
    assert np.shape(decoded.tree["vertices"]) == (6, 3)
    assert work.cost.memory == 24 * len(content)


def test_a_long_file_costs_the_memory_and_the_start_of_a_child() -> None:
    short, long = (
        plan_reading(STEP, bytes(length), None, FileLimits(), Limits()).cost
        for length in (1 << 16, (1 << 16) + 1)
    )
    assert short.memory == STEP.memory_factor * (1 << 16)
    assert long.memory == STEP.memory_factor * ((1 << 16) + 1) + STEP.base_memory
    assert long.seconds - short.seconds == pytest.approx(0.1, abs=1e-5)
    # Until then the body takes its own bytes, as the child counts as work.
    assert STEP.body_memory(1 << 20) == 1 << 20
    assert STEP.body_memory(1 << 16) == short.memory


def test_a_file_that_needs_too_much_memory_is_refused_unread() -> None:
    needed, content = STEP.memory(1 << 20), bytes(1 << 20)
    enough, little = (replace(Limits(), max_memory=most) for most in (needed, needed - 1))
    plan_reading(STEP, content, None, FileLimits(), enough)
    with pytest.raises(TooLarge) as caught:
        plan_reading(STEP, content, None, FileLimits(), little)
    assert "SURFACE_MEMORY_BYTES" in caught.value.issues[0].needed
