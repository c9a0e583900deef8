"""Signed URLs: a signature is valid for one path and one set of parameters, until it expires."""

import hmac
from collections.abc import Callable
from random import Random
from urllib.parse import parse_qsl, urlencode

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from service.api.errors import SignatureExpired, SignatureInvalid
from service.api.guard import signatures
from service.api.guard.signatures import Signer, is_signed
from service.errors import InvalidSettings
from service.schemas.request import MAX_SECONDS

OLD, NEW = "old secret of thirty-two letters", "new secret of thirty-two letters"
SIGNER = Signer([NEW])
PATH = "/v1/surfaces/saddle/mesh.glb"
END, NOW = 2_000_000_000, 1_999_999_000

with_few_examples = settings(max_examples=25)
texts = st.text("ab&=+% ;/é\n\U0001f600", max_size=4)
parameters = st.lists(st.tuples(texts, texts), max_size=4)


def sign_pairs(
    pairs: list[tuple[str, str]] | None = None, path: str = PATH
) -> list[tuple[str, str]]:
    """The parameters of the signed query: `pairs`, `expires` and `signature`."""
    return parse_qsl(SIGNER.sign(path, urlencode(pairs or []), END), keep_blank_values=True)


def verify(query: str, path: str = PATH, now: float = NOW, signer: Signer = SIGNER) -> bytes:
    """The query without `expires` and `signature`; raises if the signature is invalid."""
    query_without_signature, expires = signer.verify(path, query.encode(), now)
    assert expires == END
    return query_without_signature


def assert_refused(query: str, path: str = PATH, signer: Signer = SIGNER) -> None:
    with pytest.raises(SignatureInvalid):
        signer.verify(path, query.encode(), NOW)


@with_few_examples
@given(parameters, st.randoms(use_true_random=False))
def test_a_signature_is_valid_for_any_order_and_spelling_of_the_query(
    pairs: list[tuple[str, str]], random: Random
) -> None:
    signed_pairs = sign_pairs(pairs)
    random.shuffle(signed_pairs)
    query_without_signature = verify(
        "&".join(
            f"{_escape_letters(name)}={_escape_letters(value)}" for name, value in signed_pairs
        )
    )
    pairs_without_signature = parse_qsl(query_without_signature.decode(), keep_blank_values=True)
    assert sorted(pairs_without_signature) == sorted(pairs)
    assert not is_signed(PATH, query_without_signature)


def _escape_letters(text: str) -> str:
    """The text with every byte percent-encoded, which has the same meaning."""
    return "".join(f"%{byte:02x}" for byte in text.encode())


@with_few_examples
@given(parameters, parameters)
@example([("a", "1"), ("b", "2")], [("a", "2"), ("b", "1")])
@example([("a", "1&b=2")], [("a", "1"), ("b", "2")])
@example([("resolution", "8")], [("resolution", "8"), ("resolution", "8")])
def test_a_signature_is_invalid_for_other_parameters(
    pairs: list[tuple[str, str]], other_pairs: list[tuple[str, str]]
) -> None:
    if sorted(pairs) != sorted(other_pairs):
        expires_and_signature = sign_pairs(pairs)[-2:]
        assert_refused(urlencode(other_pairs + expires_and_signature))


@with_few_examples
@given(st.data())
def test_a_changed_character_makes_a_signature_invalid(data: st.DataObject) -> None:
    query = SIGNER.sign(PATH, "resolution=8&uvs=true", END)
    index = data.draw(st.integers(0, len(query) - 1))
    character = data.draw(st.characters(min_codepoint=33, max_codepoint=126))
    changed_query = query[:index] + character + query[index + 1 :]
    if parse_qsl(changed_query, keep_blank_values=True) != parse_qsl(query, keep_blank_values=True):
        assert_refused(changed_query)


@pytest.mark.parametrize(
    "path",
    [
        "/v1/surfaces/saddle",
        "/v1/surfaces/saddle/mesh.stl",
        "/v1/surfaces/torus/mesh.glb",
        "/v1/surfaces/saddle/mesh.glb/",
        "/v1/surfaces/saddle/mesh.glb\nresolution=8",
        "//v1/surfaces/saddle/mesh.glb",
        "/v1/surfaces/SADDLE/mesh.glb",
        "/v1/mesh",
        "/metrics",
        "",
    ],
)
def test_a_signature_is_invalid_for_other_paths(path: str) -> None:
    assert_refused(SIGNER.sign(PATH, "", END), path)


def test_a_signature_is_valid_until_it_expires() -> None:
    query = SIGNER.sign(PATH, "", END)
    assert verify(query, now=END - 0.001) == b""
    for now in (END, END + 1):
        with pytest.raises(SignatureExpired):
            SIGNER.verify(PATH, query.encode(), now)
    assert_refused(query.replace(str(END), str(END + 1)))


def test_a_signature_is_refused_while_it_expires_in_more_than_seven_days() -> None:
    query = SIGNER.sign(PATH, "", END)
    assert verify(query, now=END - MAX_SECONDS) == b""
    with pytest.raises(SignatureInvalid) as refusal:
        SIGNER.verify(PATH, query.encode(), END - MAX_SECONDS - 1)
    (issue,) = refusal.value.issues
    assert (issue.code, issue.pointer) == ("out_of_range", "/expires")
    assert issue.needed == "at most 604800 seconds from now"


CHANGES: dict[str, Callable[[str], str]] = {
    "no signature": lambda query: query.partition("&signature")[0],
    "only the value of the signature": lambda query: query.partition("signature=")[2],
    "the signature twice": lambda query: query + "&signature=" + query.rpartition("=")[2],
    "the expiry twice": lambda query: query + f"&expires={END}",
    "padding of Base64": lambda query: query + "=",
    "a space at the end": lambda query: query + "%20",
    "invalid UTF-8 at the end": lambda query: query + "%ff",
    "too many parameters": lambda query: query + "&" + "&".join(["a=1"] * 200),
    "a leading zero of the expiry": lambda query: query.replace(str(END), f"0{END}"),
    "an empty signature": lambda query: query.rpartition("=")[0] + "=",
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=list(CHANGES))
def test_urls_that_are_nearly_signed_are_refused(change: Callable[[str], str]) -> None:
    assert_refused(change(SIGNER.sign(PATH, "", END)))


def test_an_expiry_that_is_not_1_to_12_digits_is_refused_even_if_it_is_signed() -> None:
    """The digits are those of ASCII."""
    for expiry in ("-1", "1e9", "٢", "", "9" * 13, " 2000000000"):
        pairs = [("expires", expiry)]
        signature = signatures._signature(NEW.encode(), PATH, pairs)
        assert_refused(urlencode([*pairs, ("signature", signature)]))


def test_queries_that_are_not_text_are_refused() -> None:
    for query in (b"signature=\xff", b"%ff=1&expires=1&signature=a"):
        with pytest.raises(SignatureInvalid):
            SIGNER.verify(PATH, query, NOW)


def test_signatures_of_an_old_secret_are_valid_during_rotation() -> None:
    signer_of_both = Signer([NEW, OLD])
    signed_by_old, signed_by_new = (Signer([secret]).sign(PATH, "", END) for secret in (OLD, NEW))
    assert signer_of_both.sign(PATH, "", END) == signed_by_new != signed_by_old
    assert (
        verify(signed_by_old, signer=signer_of_both)
        == verify(signed_by_new, signer=signer_of_both)
        == b""
    )
    assert_refused(signed_by_old)


def test_a_signature_is_compared_with_the_signatures_of_all_secrets(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also if the first secret signed, so that the time does not reveal which secret it was."""
    compared_signatures: list[bytes] = []
    compare_digest = hmac.compare_digest

    def record_and_compare(signature_of_secret: bytes, signature_of_url: bytes) -> bool:
        compared_signatures.append(signature_of_secret)
        return bool(compare_digest(signature_of_secret, signature_of_url))

    monkeypatch.setattr(hmac, "compare_digest", record_and_compare)
    signer_of_both = Signer([NEW, OLD])
    for secret in (NEW, OLD):
        compared_signatures.clear()
        verify(Signer([secret]).sign(PATH, "", END), signer=signer_of_both)
        assert len(set(compared_signatures)) == len(compared_signatures) == 2


def test_the_rest_of_a_query_keeps_its_bytes() -> None:
    for query in ("", "resolution=16,32", "resolution=16%2C32&overlays=boundary", "&&a", "a=b=c"):
        assert verify(SIGNER.sign(PATH, query, END)).decode() == query


@pytest.mark.parametrize("secrets", [["a" * 31], [""], [NEW, "feeble"], [NEW, NEW]])
def test_weak_or_equal_secrets_are_refused_by_an_error_that_does_not_contain_them(
    secrets: list[str],
) -> None:
    with pytest.raises(InvalidSettings) as error:
        Signer(secrets)
    assert not any(secret in str(error.value) for secret in secrets if secret)


@pytest.mark.parametrize("query", ["expires=1", "signature=a", "%65xpires=1"])
def test_sign_refuses_queries_with_an_expiry_or_a_signature(query: str) -> None:
    with pytest.raises(ValueError, match="cannot be signed"):
        SIGNER.sign(PATH, query, END)


def test_sign_refuses_queries_that_are_not_utf8() -> None:
    with pytest.raises(UnicodeDecodeError):
        SIGNER.sign(PATH, "a=%ff", END)


@pytest.mark.parametrize("path", ["/v1/mesh", f"{PATH}?a=1", f"{PATH}%3Fexpires%3D1"])
def test_sign_refuses_paths_that_are_not_of_a_surface_or_a_mesh(path: str) -> None:
    with pytest.raises(ValueError, match="cannot be signed"):
        SIGNER.sign(path, "", END)
