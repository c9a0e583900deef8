"""A call of the service as a value, and as a method of every client."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Literal, ParamSpec, Self, TypeAlias, TypeVar, overload

P = ParamSpec("P")
A = TypeVar("A")

Subject: TypeAlias = Literal["surface", "curve", "url"]
"""The field that the first argument of a call is."""

Format: TypeAlias = Literal["json", "npz", "png"]
"""The format of an answer. Those of meshes and pictures have URLs, too."""

Awaited: TypeAlias = Coroutine[Any, Any, A]


class Call(Generic[P, A]):
    """One call: where it is sent, and what its answer is.

    Attributes
    ----------
    path : str
        The path of the URL.
    subject : str
        The field that the first argument is.
    names : tuple of str
        The fields that arguments without a name are.
    read : callable
        Makes the answer of the bytes of the response.
    format : str
        The name of the format that `read` reads.
    reads_files : bool
        Whether the body may be a file with the surface.
    """

    def __init__(
        self,
        function: Callable[P, A],
        read: Callable[[bytes], A],
        *,
        subject: Subject,
        format: Format,
        reads_files: bool,
    ) -> None:
        self.__name__, self.__doc__ = function.__name__, function.__doc__
        self.path = "/v1/" + {"store": "surfaces"}.get(self.__name__, self.__name__)
        self.read, self.subject = read, subject
        self.names = function.__code__.co_varnames[: function.__code__.co_argcount]
        self.format, self.reads_files = format, reads_files

    def part(self, *arguments: P.args, **fields: P.kwargs) -> Part[A]:
        """The call with its arguments, as a part of a job or for `file`; sends nothing."""
        others: dict[str, Any] = dict(zip(self.names, arguments, strict=False)) | dict(fields)
        return Part(self, others.pop(self.subject, None), others)

    @overload
    def __get__(self, client: None, owner: object) -> Self: ...

    @overload
    def __get__(self, client: Direct, owner: object) -> Callable[P, A]: ...

    @overload
    def __get__(
        self, client: Asynchronous, owner: object
    ) -> Callable[P, Coroutine[Any, Any, A]]: ...

    def __get__(self, client: Any, owner: object) -> Any:
        """The method of a client."""
        if client is None:
            return self

        def method(*arguments: P.args, **fields: P.kwargs) -> Any:
            return client.perform(self.part(*arguments, **fields))

        method.__name__, method.__doc__ = self.__name__, self.__doc__
        return method


@dataclass(frozen=True, eq=False, slots=True)
class Part(Generic[A]):
    """A call with its arguments: the surface, curve or URL, and the other fields."""

    call: Call[Any, A]
    subject: Any
    fields: Mapping[str, Any]


class Direct:
    """A client whose methods return their answers."""

    def perform(self, part: Part[A]) -> A:
        """The answer of a call."""
        raise NotImplementedError


class Asynchronous:
    """A client whose methods are awaited."""

    def perform(self, part: Part[A]) -> Coroutine[Any, Any, A]:
        """The answer of a call."""
        raise NotImplementedError
