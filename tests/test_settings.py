"""Settings from the environment."""

import logging
from dataclasses import fields, replace
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info

from service.settings import InvalidSettings, Settings, from_environment, pin_blas, with_flags


def test_an_empty_environment_gives_the_defaults() -> None:
    settings = from_environment({"PATH": "/bin"})
    assert replace(settings, store=Settings().store) == Settings()
    assert settings.workers >= 1


def test_surfaces_are_kept_in_the_folder_of_the_user_unless_another_place_is_named() -> None:
    assert Path(from_environment({}).store).is_absolute()
    assert from_environment({"SURFACE_STORE": "./data"}).store == "./data"


def test_switches_are_words_or_digits() -> None:
    for text, on in (("1", True), ("true", True), ("False", False), ("0", False)):
        assert from_environment({"SURFACE_ALLOW_DELETE": text}).allow_delete is on


def test_every_setting_has_a_variable() -> None:
    environment = {f"SURFACE_{field.name.upper()}": "1024" for field in fields(Settings)}
    environment |= {"SURFACE_ALLOW_DELETE": "1", "SURFACE_MAX_DEGREE": "5"}
    environment |= {"SURFACE_CORS_ORIGINS": "https://a, https://b"}
    settings = from_environment(environment)
    assert settings.max_body_bytes == settings.port == settings.threads == settings.workers == 1024
    assert (settings.host, settings.max_degree) == ("1024", 5)
    assert settings.cors_origins == ("https://a", "https://b")


def test_no_origins_is_a_list_too() -> None:
    assert from_environment({"SURFACE_CORS_ORIGINS": ""}).cors_origins == ()


@pytest.mark.parametrize(
    ("variable", "text"),
    [
        ("SURFACE_PORT", "tcp://10.0.0.1:80"),
        ("SURFACE_PORT", "65536"),
        ("SURFACE_PORT", ""),
        ("SURFACE_HOST", ""),
        ("SURFACE_THREADS", "-1"),
        ("SURFACE_MAX_DEGREE", "65"),
        ("SURFACE_MAX_BODY_BYTES", "64 MiB"),
        ("SURFACE_BODY_TIMEOUT", "0"),
        ("SURFACE_STORE", ""),
        ("SURFACE_ALLOW_DELETE", "yes"),
    ],
)
def test_nonsense_stops_the_start_and_is_named(variable: str, text: str) -> None:
    with pytest.raises(InvalidSettings, match=variable):
        from_environment({variable: text})


def test_flags_are_stronger_than_the_environment() -> None:
    settings = from_environment({"SURFACE_PORT": "81", "SURFACE_HOST": "::1"})
    assert with_flags(settings, {"port": "82"}) == replace(settings, host="::1", port=82)
    assert with_flags(settings, {}) == settings


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("port", "70000", "--port: got 70000, needed 0 to 65535"),
        ("port", "-1", "--port: got -1, needed 0 to 65535"),
        ("port", "http", "--port: got 'http', needed a whole number"),
        ("host", "", "--host: got nothing"),
    ],
)
def test_flags_are_checked_as_variables_are(name: str, text: str, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        with_flags(Settings(), {name: text})


def test_unknown_variable_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        found = from_environment({"SURFACE_MAX_VERTICE": "5"})
    assert found == from_environment({})
    assert "SURFACE_MAX_VERTICE" in caplog.text


def test_blas_is_pinned() -> None:
    pin_blas()
    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    assert pools
    assert {pool["num_threads"] for pool in pools} == {1}
