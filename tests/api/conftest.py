"""Fixtures that the tests of the API share."""

from collections.abc import Iterator

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tools.client import Client, start_client


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    """A client of the service with its default settings."""
    with start_client(create_app(Settings())) as client:
        yield client
