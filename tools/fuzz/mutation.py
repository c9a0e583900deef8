"""Mutations that know words and numbers, beside those of the fuzzer, which know bytes.

Numbers that must fit each other, as counts and what is counted, are seldom met by changing bytes;
a word that stands somewhere else, twice, or for another one, meets them sooner.
"""

import random
import re

_TOKENS = re.compile(rb"[0-9A-Za-z_.+-]+|\s+|[^\s0-9A-Za-z_.+-]")

VALUES = (
    b"0", b"1", b"2", b"3", b"4", b"5", b"6", b"7", b"8", b"16", b"64", b"65", b"-1", b"-0", b"1.5",
    b"1e308", b"1e400", b"5e-324", b"1e39", b"2147483648", b"18446744073709551616", b"NaN", b"inf",
    b"null", b"true", b"false", b"[]", b"{}", b'""', b"[", b"]", b"{", b"}", b",", b":", b";", b"*",
    b'"', b"\\u0000", b"\xff", b"\0", b"%00", b"&", b"=", b"\r\n", b"q=0", b"W/", b"gzip", b"json",
)  # fmt: skip
"""What is put in the place of words."""

MOST_TOKENS = 5000


def mutated(content: bytes, seed: int) -> bytes:
    """The content with some of its words changed, taken away, repeated or exchanged."""
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
