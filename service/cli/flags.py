"""Commands and their flags as rows of tables, and the values that flags set."""

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from service.cli.refusals import EXIT_CODES


@dataclass(frozen=True, slots=True)
class Flag:
    """A flag of a command, or an argument without a flag.

    Attributes
    ----------
    names : str
        `--uv`, `-o --output`, or the name of an argument without a flag.
    text : str
        The text of the help.
    metavar : str or None
        Stands for the text of the flag in the help; by default the name.
    read : callable
        Turns the text of the flag into its value; it raises no error.
    field : str or None
        The name of the value; by default the name of the flag with underscores.
    is_list : bool
        Whether the flag may be repeated; its value is then a list.
    value : object or None
        The value that a flag without a text sets.
    is_switch : bool
        Whether the flag has no text, and a second form `--no-…`.
    is_required : bool
    """

    names: str
    text: str
    metavar: str | None = None
    read: Callable[[str], object] = str
    field: str | None = None
    is_list: bool = False
    value: object = None
    is_switch: bool = False
    is_required: bool = False

    @property
    def destination(self) -> str:
        """The name of the value."""
        return self.field or self.names.split()[-1].removeprefix("--").replace("-", "_")

    def add_to(self, parser: Any) -> None:
        """Adds the flag to a parser, or to one of its groups."""
        options: dict[str, Any] = {"type": self.read, "metavar": self.metavar, "action": "store"}
        if self.is_switch:
            options = {"action": argparse.BooleanOptionalAction}
        elif self.value is not None:
            options = {"const": self.value, "action": "store_const"}
        if self.is_list:
            options["action"] = "append" if self.value is None else "append_const"
        if self.names.startswith("-"):
            options |= {"dest": self.destination, "required": self.is_required}
        parser.add_argument(*self.names.split(), help=self.text, **options)


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
        Flags below a heading, in the order of the usage line; a heading may come again.
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
        for flag in self.flags:
            flag.add_to(parser)
        if self.one_of:
            alternatives = parser.add_mutually_exclusive_group(required=True)
            for flag in self.one_of:
                flag.add_to(alternatives)
        groups: dict[str, Any] = {}
        for title, flags in self.groups:
            if title not in groups:
                groups[title] = parser.add_argument_group(title)
            for flag in flags:
                flag.add_to(groups[title])
        parser.set_defaults(run=self.run)


def read_values(arguments: argparse.Namespace, flags: Iterable[Flag]) -> dict[str, Any]:
    """The values of those flags that were given, by name; the command may lack some."""
    values = {flag.destination: getattr(arguments, flag.destination, None) for flag in flags}
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
