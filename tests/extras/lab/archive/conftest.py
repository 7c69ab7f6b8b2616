"""One store for all tests of the archive: starting it takes longer than most of them."""

from collections.abc import Iterator

import pytest

from tests.extras.lab.archive.store import FaultyStore, ObjectStore, faulty, running_store


@pytest.fixture(scope="package")
def store() -> Iterator[ObjectStore]:
    """A store that speaks S3."""
    with running_store() as found:
        yield found


@pytest.fixture(scope="package")
def shared_proxy(store: ObjectStore) -> Iterator[FaultyStore]:
    with faulty(store) as proxy:
        yield proxy


@pytest.fixture
def proxy(shared_proxy: FaultyStore) -> Iterator[FaultyStore]:
    """The same, which passes everything on."""
    shared_proxy.go_on.clear()
    shared_proxy.fail("")
    shared_proxy.seen.clear()
    shared_proxy.paths.clear()
    yield shared_proxy
    shared_proxy.go_on.set()
