"""The first inputs of the fuzzer cause no findings; a refusal of an input is no finding."""

import time

import pytest

from service.errors import Issue, MalformedBody
from tools.fuzz.judge import MEMORY, TooExpensive, judge, measure_peak, measure_resident
from tools.fuzz.seeds import MAX_INPUT_BYTES, SEEDS
from tools.fuzz.targets import TARGETS


@pytest.mark.parametrize("name", TARGETS)
def test_first_inputs_of_the_fuzzer_are_no_findings(name: str) -> None:
    """The test takes at most 79 inputs of each target; the fuzzer takes all of them."""
    inputs = [content for content in SEEDS[name]() if len(content) <= MAX_INPUT_BYTES]
    assert inputs
    for content in inputs[:: max(1, len(inputs) // 40)]:
        judge(TARGETS[name], content)


def test_every_target_has_first_inputs() -> None:
    assert SEEDS.keys() == TARGETS.keys()


def test_a_refusal_is_no_finding() -> None:
    def refuse(_: bytes) -> None:
        raise MalformedBody(Issue("malformed_body", "no"))

    judge(refuse, b"")


def test_other_exceptions_and_too_much_time_or_memory_are_findings() -> None:
    def decode_ascii(content: bytes) -> None:
        content.decode("ascii")

    def work_too_long(_: bytes) -> None:
        end = time.process_time() + 0.02
        while time.process_time() < end:
            pass

    def allocate_too_much(_: bytes) -> None:
        # The judge compares peaks of memory, so this must be more than the peak of earlier tests.
        assert len(b"x" * (measure_peak() - measure_resident() + 2 * MEMORY)) > MEMORY

    judge(decode_ascii, b"x")
    with pytest.raises(UnicodeDecodeError):
        judge(decode_ascii, b"\xff")
    with pytest.raises(TooExpensive, match="s for 0 bytes"):
        judge(work_too_long, b"", seconds=0.01)
    with pytest.raises(TooExpensive, match="MiB for 0 bytes"):
        judge(allocate_too_much, b"")
