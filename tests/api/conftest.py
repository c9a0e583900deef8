"""Fixtures that the tests of the API share."""

from collections.abc import Iterator

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tests.api.client import Client, client_of


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    """A client of the service with its default settings."""
    with client_of(create_app(Settings())) as client:
        yield client
