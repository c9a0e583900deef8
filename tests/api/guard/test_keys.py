"""Keys: how they are created, listed, compared, and read from the header `Authorization`."""

import re

import pytest

from service.api.guard import keys
from service.api.guard.keys import (
    find_entry,
    format_entry,
    make_key,
    parse_bearer,
    parse_entries,
)
from service.errors import InvalidSettings
from tools.programs import run_python

OLD, NEW = make_key(), make_key()
ENTRIES = parse_entries(
    [format_entry("alice", OLD), format_entry("alice", NEW), format_entry("bob", make_key())]
)


def test_a_key_is_256_random_bits() -> None:
    assert re.fullmatch("sfk_[0-9a-f]{64}", NEW)
    assert len({make_key() for _ in range(100)}) == 100


def test_the_entry_of_a_key_has_its_hash_and_not_the_key() -> None:
    line = format_entry("alice", NEW)
    assert line.startswith("alice:")
    assert NEW.removeprefix(keys.PREFIX) not in line


def test_a_name_may_have_an_old_and_a_new_key() -> None:
    assert [find_entry(key.encode(), ENTRIES) for key in (OLD, NEW)] == list(ENTRIES[:2])
    assert [entry.name for entry in ENTRIES[:2]] == ["alice", "alice"]
    assert find_entry(make_key().encode(), ENTRIES) is None
    assert find_entry(NEW.encode(), ()) is None


def test_texts_that_differ_in_one_character_are_not_the_key() -> None:
    for index in range(len(NEW)):
        other_key = NEW[:index] + ("0" if NEW[index] != "0" else "1") + NEW[index + 1 :]
        assert find_entry(other_key.encode(), ENTRIES) is None
    for other_key in (NEW.upper(), NEW[:-1], NEW + "0", NEW + "\n", ""):
        assert find_entry(other_key.encode(), ENTRIES) is None


def test_a_password_whose_hash_is_listed_is_not_a_key() -> None:
    assert find_entry(b"password", parse_entries([format_entry("eve", "password")])) is None


def test_a_key_is_compared_with_all_entries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So the time of a comparison does not reveal which entry is equal."""
    compared_digests: list[bytes] = []

    def record_and_compare(digest: bytes, digest_of_entry: bytes) -> bool:
        compared_digests.append(digest)
        return digest == digest_of_entry

    monkeypatch.setattr(keys, "compare_digest", record_and_compare)
    for key in (OLD, NEW, make_key()):
        compared_digests.clear()
        find_entry(key.encode(), ENTRIES)
        assert compared_digests == [entry.digest for entry in ENTRIES]


@pytest.mark.parametrize(
    "line", ["alice", "alice:", "alice:00", ":" + "0" * 64, "a b:" + "0" * 64, "alice:" + "g" * 64]
)
def test_invalid_entries_are_named_by_their_number_and_not_repeated(line: str) -> None:
    with pytest.raises(InvalidSettings, match="key 2 ") as error:
        parse_entries([format_entry("bob", NEW), line])
    assert "alice" not in str(error.value)
    assert "0000" not in str(error.value)


def test_a_key_in_place_of_its_hash_is_refused_and_not_repeated() -> None:
    with pytest.raises(InvalidSettings) as error:
        parse_entries([f"alice:{NEW}"])
    assert NEW not in str(error.value)


def test_an_entry_without_scopes_permits_all_but_lists_of_stored_surfaces() -> None:
    (entry,) = parse_entries([format_entry("alice", NEW)])
    assert entry.scopes == {"read", "compute", "store", "delete"}


@pytest.mark.parametrize("scopes", [frozenset({"admin"}), frozenset(keys.SCOPES)])
def test_an_entry_lists_other_scopes(scopes: frozenset[keys.KeyScope]) -> None:
    line = format_entry("alice", NEW, scopes)
    assert [entry.scopes for entry in parse_entries([line])] == [scopes]


@pytest.mark.parametrize("names", ["", "reed", "read,compute", "read+", "read+ compute", "Read"])
def test_unknown_scopes_are_refused_with_the_names_of_all(names: str) -> None:
    line = f"{format_entry('alice', NEW)}:{names}"
    needed = "key 1 has unknown scopes .*read, compute, store, delete, admin"
    with pytest.raises(InvalidSettings, match=needed):
        parse_entries([line])


def test_repeated_keys_and_too_many_keys_are_refused() -> None:
    with pytest.raises(InvalidSettings, match="twice"):
        keys.join_entries(
            parse_entries([format_entry("alice", NEW)]), parse_entries([format_entry("bob", NEW)])
        )
    entries = parse_entries([format_entry("alice", str(i)) for i in range(keys.MAX_KEYS + 1)])
    with pytest.raises(InvalidSettings, match="too many"):
        keys.join_entries(entries)


@pytest.mark.parametrize(
    ("header", "key"),
    [
        (None, None),
        (b"", None),
        (b"Bearer abc", b"abc"),
        (b"bearer  abc ", b"abc"),
        (b"Bearer", b""),
        (b"Basic YWxpY2U6c2VjcmV0", None),
        (b"abc", None),
    ],
)
def test_keys_are_bearer_tokens(header: bytes | None, key: bytes | None) -> None:
    assert parse_bearer(header) == key


def test_the_command_prints_a_key_and_its_entry() -> None:
    output = run_python("-m", "service", "key", "alice").stdout
    (_, key), (_, entry) = (line.split() for line in output.splitlines())
    found = find_entry(key.encode(), parse_entries([entry]))
    assert found is not None
    assert (found.name, found.scopes) == ("alice", keys.DEFAULT_SCOPES)
    for arguments in (["a b"], ["alice", "--scope", "reed"]):
        process = run_python("-m", "service", "key", *arguments, check=False)
        assert (process.returncode, process.stdout) == (2, "")


def test_the_command_prints_an_entry_with_scopes() -> None:
    output = run_python("-m", "service", "key", "ann", "--scope", "read+admin").stdout
    (entry,) = parse_entries([output.splitlines()[1].split()[1]])
    assert entry.scopes == {"read", "admin"}
