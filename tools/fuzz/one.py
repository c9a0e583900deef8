"""Fuzzes one target, in a process of its own, until the time is over or there is a finding.

Atheris mutates inputs, and keeps those that reach new code. The exit code is 0 without a finding.
Half of the mutations are by Atheris, which changes bytes; the others are by this module, which
changes words and numbers. After a change of bytes, numbers that must agree, such as counts and
lengths, rarely agree. If words are moved, repeated or replaced, they agree more often.
"""

import random
import re
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["service"]):
    from tools.fuzz.judge import judge
    from tools.fuzz.seeds import MAX_INPUT_BYTES, SEEDS
    from tools.fuzz.targets import TARGETS

SEED = 20260101
MAX_INPUT_SECONDS = 30
"""Seconds after which Atheris ends the process with a finding. `judge` limits the CPU time of
inputs that end sooner."""

MAX_MEMORY_MIB = 2048
"""The largest memory of the process, including the inputs that Atheris keeps."""

_TOKENS = re.compile(rb"[0-9A-Za-z_.+-]+|\s+|[^\s0-9A-Za-z_.+-]")
"""The words of an input: letters and digits, blanks, or one other character."""

VALUES = (
    b"0", b"1", b"2", b"3", b"4", b"5", b"6", b"7", b"8", b"16", b"64", b"65", b"-1", b"-0", b"1.5",
    b"1e308", b"1e400", b"5e-324", b"1e39", b"2147483648", b"18446744073709551616", b"NaN", b"inf",
    b"null", b"true", b"false", b"[]", b"{}", b'""', b"[", b"]", b"{", b"}", b",", b":", b";", b"*",
    b'"', b"\\u0000", b"\xff", b"\0", b"%00", b"&", b"=", b"\r\n", b"q=0", b"W/", b"gzip", b"json",
)  # fmt: skip
"""Texts that replace words of an input."""

MAX_TOKENS = 5000
"""The largest number of words of a mutated input; the rest of the input is cut off."""


def main(name: str, seconds: str, folder: str) -> None:
    """Fuzzes a target; Atheris ends the process."""
    corpus = Path(folder) / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(SEEDS[name]()):
        if len(content) <= MAX_INPUT_BYTES:
            (corpus / f"seed-{number:04}").write_bytes(content)
    target = TARGETS[name]
    # The options are those of libFuzzer, which Atheris uses; `len_control=0` allows long inputs at
    # once.
    arguments = [
        sys.argv[0],
        str(corpus),
        f"-max_total_time={seconds}",
        f"-max_len={MAX_INPUT_BYTES}",
        f"-seed={SEED}",
        f"-timeout={MAX_INPUT_SECONDS}",
        f"-rss_limit_mb={MAX_MEMORY_MIB}",
        f"-artifact_prefix={folder}/found-{name}-",
        "-print_final_stats=1",
        "-verbosity=0",
        "-len_control=0",
    ]

    def mutate(content: bytes, max_length: int, seed: int) -> bytes:
        """A mutated input: by this module for even seeds, by Atheris for odd seeds."""
        if seed % 2:
            return bytes(atheris.Mutate(content, max_length))
        return mutate_content(content, seed)[:max_length]

    atheris.Setup(arguments, lambda content: judge(target, content), custom_mutator=mutate)
    atheris.Fuzz()


def mutate_content(content: bytes, seed: int) -> bytes:
    """The content after some random changes of words: replaced, removed, repeated, exchanged."""
    generator = random.Random(seed)
    tokens = _TOKENS.findall(content)[:MAX_TOKENS]
    for _ in range(generator.choice((1, 1, 2, 3, 6))):
        if not tokens:
            return generator.choice(VALUES)
        _change_token(tokens, generator)
    return b"".join(tokens)


def _change_token(tokens: list[bytes], generator: random.Random) -> None:
    """Changes, exchanges, removes or inserts some of the words, in place."""
    first, second = (generator.randrange(len(tokens)) for _ in range(2))  # indices of words
    length = generator.choice((1, 1, 2, 4, 8, 16))
    match generator.randrange(6):
        case 0:
            tokens[first] = generator.choice(VALUES)
        case 1:
            tokens[first] = tokens[second]
        case 2:
            tokens[first], tokens[second] = tokens[second], tokens[first]
        case 3:
            del tokens[first : first + length]
        case 4:
            tokens[second:second] = tokens[first : first + length]
        case _:
            tokens.insert(first, generator.choice(VALUES))


if __name__ == "__main__":
    main(*sys.argv[1:])
