"""The progress of long commands: a bar on a terminal, lines elsewhere."""

import io

import pytest

from service.cli.progress import Progress, describe, describe_seconds
from tests.clock import Clock


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_shows_a_bar_with_rate_and_time_left(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    progress = Progress(100)
    clock.now += 2
    progress.show(50, 1)
    assert terminal.getvalue().strip() == (
        "[############------------] 50 of 100, 25/s, 2 s left, 1 failed"
    )
    clock.now += 0.1
    progress.show(60, 1)  # too soon for another picture
    assert "60" not in terminal.getvalue()
    progress.clear()
    assert terminal.getvalue().endswith("\r")
    assert not terminal.getvalue().splitlines()[-1].strip()


def test_elsewhere_a_line_comes_now_and_then(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    progress = Progress(None)
    clock.now += 10
    progress.show(50, 0)
    assert capsys.readouterr().err == ""
    clock.now += 50
    progress.show(600, 0)
    progress.clear()
    assert capsys.readouterr().err == "surface: 600, 10/s\n"


def test_the_rate_follows_the_last_seconds(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    progress = Progress(10_000)
    for ended in (3000, 6000, 6300):  # 100 a second, and then 10
        clock.now += 30
        progress.show(ended, 0)
    assert capsys.readouterr().err.splitlines()[-1] == (
        "surface: 6,300 of 10,000, 10/s, 6 min 10 s left"
    )


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "0 s"), (59.4, "59 s"), (125, "2 min 05 s"), (12_000, "3 h 20 min")],
)
def test_times_have_two_units(seconds: float, text: str) -> None:
    assert describe_seconds(seconds) == text


def test_without_a_rate_no_time_is_left() -> None:
    assert describe(0, 0, 10, 0.0) == "0 of 10, 0/s"
