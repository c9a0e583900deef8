"""Names of CAD files as the fields of documents accept them."""

import re

MAX_NAME = 100
"""The most characters of a name in a document."""

_UNWANTED = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
"""Control characters, line separators, and halves of surrogate pairs, which UTF-8 cannot encode."""


class NameCleaner:
    """Cleans names, and counts those that it had to change.

    Attributes
    ----------
    changed : int
        Number of names that were shortened or cleaned.
    """

    __slots__ = ("changed",)

    def __init__(self) -> None:
        self.changed = 0

    def clean(self, name: str) -> str:
        """The name without unwanted characters and with at most `MAX_NAME`; it may be empty."""
        cleaned = clean_text(name)
        self.changed += cleaned != name
        return cleaned


def clean_text(text: str, max_length: int = MAX_NAME) -> str:
    """A text with a blank in place of each unwanted character, shortened; empty if it is blank."""
    cleaned = _UNWANTED.sub(" ", text[:max_length])
    return "" if cleaned.isspace() else cleaned
