"""Names that clients and operators use, such as URLs, JSON fields and settings, stay."""

from tools.contract import CONTRACT, list_names


def test_all_names_of_the_contract_exist() -> None:
    """To remove a name, delete its line by hand; `make generated` only adds lines."""
    missing = set(CONTRACT.read_text(encoding="utf-8").splitlines()) - list_names()
    assert not missing, (
        f"restore these names, or delete them from {CONTRACT} and say so in CHANGELOG.md"
    )
