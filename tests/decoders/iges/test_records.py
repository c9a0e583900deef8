"""Words of records and their values."""

import numpy as np
import pytest

from service.decoders.iges.faults import Fault
from service.decoders.iges.records import Parameters, split_words

DELIMITERS = (",", ";")


def test_strings_are_taken_by_their_count() -> None:
    assert split_words("406,1, 7Ha,b;c H, 2 ;", DELIMITERS) == ["406", "1", "a,b;c H", "2"]


def test_a_wrong_count_loses_one_string_only() -> None:
    assert split_words("406,3Hname,5;", DELIMITERS) == ["406", "nam", "5"]
    assert split_words("406,99Hname,5;", DELIMITERS) == ["406", "name,5;"]


def test_characters_of_several_bytes_may_count_as_one() -> None:
    name = "Größe".encode().decode("latin-1")
    for count in (5, 7):
        assert split_words(f"406,{count}H{name},5;", DELIMITERS) == ["406", name, "5"]


def test_the_rest_behind_a_record_is_ignored() -> None:
    assert split_words("110,1.,2.;    comment, more", DELIMITERS) == ["110", "1.", "2."]


def test_numbers_may_have_exponents_of_fortran() -> None:
    parameters = Parameters(["1.5D3", "2d-1", "", "-.5E+1", "7"])
    np.testing.assert_array_equal(parameters.numbers(0, 5), [1500.0, 0.2, 0.0, -5.0, 7.0])
    assert parameters.number(2, 4.0) == 4.0
    assert parameters.integer(4) == 7
    assert parameters.integer(2, 3) == 3


@pytest.mark.parametrize("word", ["nan", "1e999", "2.D12", "-inf", "text"])
def test_numbers_are_finite_and_not_too_large(word: str) -> None:
    parameters = Parameters([word])
    with pytest.raises(Fault):
        parameters.number(0)
    with pytest.raises(Fault):
        parameters.numbers(0, 1)
    with pytest.raises(Fault):
        parameters.integer(0)


def test_counts_have_as_many_words() -> None:
    parameters = Parameters(["3", "1", "1", "1"])
    assert parameters.count(0) == 3
    for read in (lambda: parameters.count(0, 2), lambda: parameters.numbers(2, 3)):
        with pytest.raises(Fault):
            read()
    with pytest.raises(Fault):
        Parameters(["-1"]).count(0)


def test_whole_numbers_are_whole() -> None:
    assert Parameters(["5.0"]).integer(0) == 5
    with pytest.raises(Fault):
        Parameters(["5.5"]).integer(0)


def test_texts_are_utf_8_or_latin_1() -> None:
    utf_8 = "Größe".encode().decode("latin-1")
    assert Parameters([utf_8]).text(0) == "Größe"
    assert Parameters(["Größe"]).text(0) == "Größe"
    assert len(Parameters(["x" * 5000]).text(0)) == 1000
