"""Fuzzes one target until the time is up or something is found: a process of its own.

Atheris mutates, and keeps what reaches code that nothing reached before. Its exit code is 0 if
nothing was found.
"""

import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["service"]):
    from tools.fuzz.judge import judged
    from tools.fuzz.mutation import mutated
    from tools.fuzz.seeds import LARGEST, SEEDS
    from tools.fuzz.targets import TARGETS

SEED = 20260101
SLOW = 30
"""Seconds after which an input never ends; less is judged by the time of the processor."""

TOTAL = 2048
"""MiB that the whole process may take, the inputs that are kept included."""


def main(name: str, seconds: str, folder: str) -> None:
    """Fuzzes; does not return."""
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
        """Every other time the fuzzer's own way."""
        if seed % 2:
            return bytes(atheris.Mutate(content, most))
        return mutated(content, seed)[:most]

    atheris.Setup(arguments, lambda content: judged(target, content), custom_mutator=mutate)
    atheris.Fuzz()


if __name__ == "__main__":
    main(*sys.argv[1:])
