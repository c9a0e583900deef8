"""Counts of entities and faces that are not in the result."""

from collections import Counter

from service.decoders.cad.content import SkippedFace

MAX_KEYWORDS = 100
"""The most keywords of skipped entities that are named; the rest is counted together."""

MAX_KEYWORD_LENGTH = 80

OTHERS = "others"


class Tally:
    """Counts of skipped entities, and the faces that could not be read.

    Attributes
    ----------
    skipped_entities : Counter
        By keyword.
    skipped_faces : list of SkippedFace
    """

    def __init__(self) -> None:
        self.skipped_entities: Counter[str] = Counter()
        self.skipped_faces: list[SkippedFace] = []

    def skip(self, keyword: str, count: int = 1) -> None:
        """Count entities that are not read."""
        keyword = keyword[:MAX_KEYWORD_LENGTH]
        if keyword not in self.skipped_entities and len(self.skipped_entities) >= MAX_KEYWORDS:
            keyword = OTHERS
        self.skipped_entities[keyword] += count

    def skip_face(self, number: int, reason: str) -> None:
        """Note that a face is not read, and why."""
        self.skipped_faces.append(SkippedFace(f"#{number}", reason))
