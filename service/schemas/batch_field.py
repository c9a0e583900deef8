"""A field that is a list of objects, read to columns in batches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, TypeAdapter, ValidationError, ValidationInfo
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from service.errors import MAX_ISSUES, Issue, count_nouns
from service.schemas.batches import Unreadable
from service.schemas.document import DocumentLimits
from service.schemas.fields import StrictModel, length_issue
from service.schemas.validation import limits_of, to_invalid, to_refusal, wrong_type


@dataclass(frozen=True)
class ReadInBatches:
    """The annotation of a list that is read to columns in batches.

    Attributes
    ----------
    read : callable
        Reads items to columns, or raises `Unreadable`.
    model : type
        The model of one item, which words the errors.
    noun : str
        Plural noun for the items.
    columns : type
        The class of the columns, which a document that is no JSON may have in place of the list.
    check : callable
        Checks such columns and returns them in their normal form, or raises `Unreadable`.
    write : callable
        The list of such columns.
    min_count : int
        The least number of items.
    """

    read: Callable[[Sequence[Any], DocumentLimits], Any]
    model: type[StrictModel]
    noun: str
    columns: type
    check: Callable[[Any, DocumentLimits], Any]
    write: Callable[[Any], list[Any]]
    min_count: int = 0

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """The validator of the field; the JSON Schema is that of the list of models."""
        adapter: TypeAdapter[StrictModel] = TypeAdapter(self.model)

        def validate(value: Any, _: Any, info: ValidationInfo) -> Any:
            is_list = isinstance(value, list)
            if not is_list and not isinstance(value, self.columns):
                raise to_invalid(wrong_type(value, f"a list of {self.noun}"))
            if len(value) < self.min_count:
                got = f"a list of {count_nouns(len(value), self.noun)}"
                raise to_invalid(length_issue(got, f"at least {self.min_count}"))
            limits = limits_of(info)
            try:
                return self.read(value, limits) if is_list else self.check(value, limits)
            except Unreadable:
                items = value if is_list else self.write(value)
                raise self._word_errors(items, adapter, limits) from None

        return core_schema.with_info_wrap_validator_function(validate, handler(source))

    def _word_errors(
        self, items: list[Any], adapter: TypeAdapter[StrictModel], limits: DocumentLimits
    ) -> ValidationError:
        """The errors of the first wrong item, and of some after it.

        At most `MAX_ISSUES` items are checked by their models, which take milliseconds.
        """
        first = self._find_first_wrong(items, limits)
        details: list[InitErrorDetails] = []
        for number, item in enumerate(items[first : first + MAX_ISSUES], start=first):
            try:
                adapter.validate_python(item, context=limits)
            except ValidationError as error:
                found = error.errors(include_url=False)[:MAX_ISSUES]
                details += [_nest(detail, number) for detail in found]
            if len(details) >= MAX_ISSUES:
                break
        if details:
            return ValidationError.from_exception_data("value", details)
        # Never seen: the batches and the models accept the same items.
        issue = Issue("wrong_value", "The value is not allowed.", "", "an object", "another value")
        return to_refusal([((first,), issue)])

    def _find_first_wrong(self, items: list[Any], limits: DocumentLimits) -> int:
        """The number of the first item that cannot be read, found by halving."""
        first, last = 0, len(items)
        while last - first > 1:
            middle = (first + last) // 2
            try:
                self.read(items[first:middle], limits)
            except Unreadable:
                last = middle
            else:
                first = middle
        return first


def _nest(detail: Any, number: int) -> InitErrorDetails:
    """The detail of an error of one item, for the list in which the item has this number."""
    context = detail.get("ctx", {})
    nested: InitErrorDetails = {
        "type": detail["type"],
        "loc": (number, *detail["loc"]),
        "input": detail["input"],
        "ctx": context,
    }
    if detail["type"] == "issue":
        nested["type"] = PydanticCustomError("issue", "{message}", context)
    return nested
