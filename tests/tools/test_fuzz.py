"""Every seed passes its target, and the judge distinguishes findings from refusals."""

import time

import pytest

from service.errors import Issue, MalformedBody
from tools.fuzz.judge import MEMORY, TooExpensive, judge, measure_most_resident, measure_resident
from tools.fuzz.seeds import LARGEST, SEEDS
from tools.fuzz.targets import TARGETS


@pytest.mark.parametrize("name", TARGETS)
def test_the_first_inputs_of_the_fuzzer_have_no_faults(name: str) -> None:
    """A part of the seeds; the fuzzer uses all of them and their mutations."""
    seeds = [content for content in SEEDS[name]() if len(content) <= LARGEST]
    assert seeds
    for content in seeds[:: max(1, len(seeds) // 40)]:
        judge(TARGETS[name], content)


def test_every_target_has_seeds() -> None:
    assert SEEDS.keys() == TARGETS.keys()


def test_a_refusal_is_no_finding() -> None:
    def refusing(_: bytes) -> None:
        raise MalformedBody(Issue("malformed_body", "no"))

    judge(refusing, b"")


def test_other_exceptions_and_too_much_work_are_findings() -> None:
    def failing(content: bytes) -> None:
        content.decode("ascii")

    def slow(_: bytes) -> None:
        end = time.process_time() + 0.02
        while time.process_time() < end:
            pass

    def greedy(_: bytes) -> None:
        # More than other tests had in this process: the most that it ever held is what is seen.
        assert len(b"x" * (measure_most_resident() - measure_resident() + 2 * MEMORY)) > MEMORY

    judge(failing, b"x")
    with pytest.raises(UnicodeDecodeError):
        judge(failing, b"\xff")
    with pytest.raises(TooExpensive, match="s for 0 bytes"):
        judge(slow, b"", seconds=0.01)
    with pytest.raises(TooExpensive, match="MiB for 0 bytes"):
        judge(greedy, b"")
