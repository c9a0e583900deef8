"""Names that clients and operators depend on stay."""

from tools.contract import CONTRACT, list_names


def test_no_name_of_the_contract_is_gone() -> None:
    """A person who removes a name deletes its line by hand; `make generated` only adds lines."""
    gone = set(CONTRACT.read_text(encoding="utf-8").splitlines()) - list_names()
    assert not gone, f"put these names back, or delete them from {CONTRACT} and say so in CHANGELOG"
