"""Fuzzes one target until the time is up or something is found: a process of its own.

Atheris mutates inputs, and keeps those that reach new code. The exit code is 0 if nothing was
found. Atheris changes bytes; the mutations of this module change words and numbers too. Numbers
that must agree, such as counts and lengths, rarely agree after a change of bytes. Moving, repeating
or replacing words finds such inputs sooner.
"""

import random
import re
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["service"]):
    from tools.fuzz.judge import judge
    from tools.fuzz.seeds import LARGEST, SEEDS
    from tools.fuzz.targets import TARGETS

SEED = 20260101
SLOW = 30
"""Seconds after which an input counts as endless; shorter runs are judged by their CPU time."""

TOTAL = 2048
"""MiB of memory for the whole process, kept inputs included."""

_TOKENS = re.compile(rb"[0-9A-Za-z_.+-]+|\s+|[^\s0-9A-Za-z_.+-]")

VALUES = (
    b"0", b"1", b"2", b"3", b"4", b"5", b"6", b"7", b"8", b"16", b"64", b"65", b"-1", b"-0", b"1.5",
    b"1e308", b"1e400", b"5e-324", b"1e39", b"2147483648", b"18446744073709551616", b"NaN", b"inf",
    b"null", b"true", b"false", b"[]", b"{}", b'""', b"[", b"]", b"{", b"}", b",", b":", b";", b"*",
    b'"', b"\\u0000", b"\xff", b"\0", b"%00", b"&", b"=", b"\r\n", b"q=0", b"W/", b"gzip", b"json",
)  # fmt: skip
"""Replacements for words."""

MOST_TOKENS = 5000


def main(name: str, seconds: str, folder: str) -> None:
    """Fuzzes a target; ends the process."""
    corpus = Path(folder) / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(SEEDS[name]()):
        if len(content) <= LARGEST:
            (corpus / f"seed-{number:04}").write_bytes(content)
    target = TARGETS[name]
    arguments = [
        sys.argv[0],
        str(corpus),
        f"-max_total_time={seconds}",
        f"-max_len={LARGEST}",
        f"-seed={SEED}",
        f"-timeout={SLOW}",
        f"-rss_limit_mb={TOTAL}",
        f"-artifact_prefix={folder}/found-{name}-",
        "-print_final_stats=1",
        "-verbosity=0",
        "-len_control=0",
    ]

    def mutate(content: bytes, most: int, seed: int) -> bytes:
        """One mutation: half of them by Atheris, half by this module."""
        if seed % 2:
            return bytes(atheris.Mutate(content, most))
        return mutate_content(content, seed)[:most]

    atheris.Setup(arguments, lambda content: judge(target, content), custom_mutator=mutate)
    atheris.Fuzz()


def mutate_content(content: bytes, seed: int) -> bytes:
    """The content with some of its words changed, removed, repeated or exchanged."""
    chance = random.Random(seed)
    tokens = _TOKENS.findall(content, 0, len(content))[:MOST_TOKENS]
    for _ in range(chance.choice((1, 1, 2, 3, 6))):
        if not tokens:
            return chance.choice(VALUES)
        _change(tokens, chance)
    return b"".join(tokens)


def _change(tokens: list[bytes], chance: random.Random) -> None:
    place, other = chance.randrange(len(tokens)), chance.randrange(len(tokens))
    length = chance.choice((1, 1, 2, 4, 8, 16))
    match chance.randrange(6):
        case 0:
            tokens[place] = chance.choice(VALUES)
        case 1:
            tokens[place] = tokens[other]
        case 2:
            tokens[place], tokens[other] = tokens[other], tokens[place]
        case 3:
            del tokens[place : place + length]
        case 4:
            tokens[other:other] = tokens[place : place + length]
        case _:
            tokens.insert(place, chance.choice(VALUES))


if __name__ == "__main__":
    main(*sys.argv[1:])
