"""What an attack is: what is sent, and which answers are those that are documented."""

import re
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Attack:
    """One row of the table.

    Attributes
    ----------
    name : str
    run : function
        Attacks the service at a port; returns its answers in short, and how many of each.
    answers : str
        A regular expression of the answers that are documented.
    parses : bool
        Whether it sends the largest JSON: while that is parsed, Python does nothing else.
    """

    name: str
    run: Callable[[int], Awaitable[Counter[str]]]
    answers: str
    parses: bool = False

    def wrong(self, answers: Mapping[str, int]) -> list[str]:
        """The answers that are not documented; or that there were none at all."""
        if not answers:
            return ["nothing happened"]
        return [answer for answer in answers if not re.fullmatch(self.answers, answer)]


BUSY = r"429 busy|503 out_of_time"
"""What a service that has enough to do may always say."""

DONE = rf"200|422 (result_too_large|invalid_request|unsupported_by_format)|{BUSY}"
"""What becomes of work."""
