"""Commands and their flags as rows of tables, and the values that flags set."""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from service.cli.refusals import EXIT_CODES


class Flag(NamedTuple):
    """A flag of a command, or an argument without a flag: the arguments of `add_argument`."""

    names: Sequence[str]
    options: Mapping[str, Any]

    @property
    def destination(self) -> str:
        """The name of the flag's value."""
        name = self.names[-1].removeprefix("--").replace("-", "_")
        return str(self.options.get("dest", name))


def flag(names: str, text: str, metavar: str | None = None, **options: Any) -> Flag:
    """A flag with its names (`-o --output`), the text of its help, and options of argparse.

    The functions that read the text of a flag (`type`) raise no errors: only a command refuses a
    value.
    """
    if metavar is not None:
        options["metavar"] = metavar
    return Flag(names.split(), {"help": text, **options})


Flags = tuple[Flag, ...]


@dataclass(frozen=True, slots=True)
class Command:
    """A command.

    Attributes
    ----------
    name, text : str
        Its name, and its line in the list of commands.
    run : callable
        Runs the command and returns its exit code. It imports slow modules inside, so that `--help`
        is fast.
    flags : tuple of Flag
    one_of : tuple of Flag
        Flags of which exactly one must be given.
    groups : tuple of (str, tuple of Flag)
        Flags below a heading, in the order of the usage line; several may have one heading.
    description : str or None
    has_exit_codes : bool
        Whether the help lists the exit codes.
    """

    name: str
    text: str
    run: Callable[[argparse.Namespace], int]
    flags: Flags = ()
    one_of: Flags = ()
    groups: tuple[tuple[str, Flags], ...] = ()
    description: str | None = None
    has_exit_codes: bool = False

    def add_to(self, commands: Any) -> None:
        """Adds the command to the result of `add_subparsers`, whose type argparse hides."""
        help_form: dict[str, Any] = {}
        if self.has_exit_codes:
            raw = argparse.RawDescriptionHelpFormatter
            help_form = {"epilog": EXIT_CODES, "formatter_class": raw}
        parser = commands.add_parser(
            self.name, help=self.text, description=self.description, **help_form
        )
        _add_flags(parser, self.flags)
        if self.one_of:
            _add_flags(parser.add_mutually_exclusive_group(required=True), self.one_of)
        groups: dict[str, Any] = {}
        for title, flags in self.groups:
            if title not in groups:
                groups[title] = parser.add_argument_group(title)
            _add_flags(groups[title], flags)
        parser.set_defaults(run=self.run)


@dataclass(frozen=True, slots=True)
class CommandGroup:
    """Commands below a name, such as `surface stored list`; attributes as those of `Command`."""

    name: str
    text: str
    commands: tuple[Command, ...]

    def add_to(self, commands: Any) -> None:
        """Adds the commands to the result of `add_subparsers`."""
        parser = commands.add_parser(self.name, help=self.text, description=f"{self.text}.")
        below = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
        for command in self.commands:
            command.add_to(below)


def _add_flags(parser: Any, flags: Flags) -> None:
    for each in flags:
        parser.add_argument(*each.names, **each.options)


def read_values(arguments: argparse.Namespace, flags: Iterable[Flag]) -> dict[str, Any]:
    """The values of those flags that were given, by name; the command may lack some."""
    values = {each.destination: getattr(arguments, each.destination, None) for each in flags}
    return {name: value for name, value in values.items() if value is not None}


def option_texts(values: dict[str, Any]) -> dict[str, str]:
    """The values of options as texts of a query."""
    return {
        name: str(value).lower() if isinstance(value, bool) else value
        for name, value in values.items()
    }


def parse_numbers(text: str) -> list[int | float | str]:
    """Comma-separated numbers; a malformed number stays a string, which the model refuses."""
    return [parse_number(part) for part in text.split(",")]


def parse_number(text: str) -> int | float | str:
    """One number; a malformed number stays a string, which the model refuses."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
