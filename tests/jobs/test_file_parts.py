"""Parts of jobs with a file: their ids, the store that keeps the file, and what batches make."""

import asyncio
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
from obstore.store import MemoryStore

from service.api.app import create_app
from service.decoders.registry import BY_NAME
from service.errors import InvalidRequest, JobQuotaFull, UnknownSurface
from service.jobs.batch import BatchResult, Task, read_result, run_batch
from service.jobs.checks import CheckedPart, check_part
from service.jobs.file_parts import file_part_id, read_file_part
from service.jobs.files import JobFiles
from service.jobs.keys import file_key, part_key
from service.jobs.results import read_object
from service.jobs.sources import SourceFiles
from service.jobs.usage import JobUsage
from service.pipeline.calls import CALLS, CallLimits
from service.schemas.jobs import FILE_ID
from service.settings.values import Settings
from service.storage.address import open_store
from service.storage.backends import Bucket, Entry
from service.surface.kinds import Surface
from tools.client import Client, start_client
from tools.hostile.files import NPY, build_net, save_array

LIMITS = CallLimits()
NET = save_array(build_net())
ID = f"{sha256(NET).hexdigest()}.npy"
QUERY = "format=glb&resolution=3&name=net"
PATH = f"/v1/mesh?{QUERY}"


def find_none(_: str) -> Surface:
    raise UnknownSurface


def check(path: str, id: str = ID, **fields: Any) -> CheckedPart:
    return check_part({"path": path, "file": id} | fields, LIMITS, find_none, lambda _: len(NET))


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings())) as client:
        yield client


@pytest.fixture
def store(tmp_path: Path) -> str:
    """The address of a new store."""
    address = str(tmp_path / "store")
    open_store(address, 0)
    return address


def run(store: str, *parts: CheckedPart) -> BatchResult:
    lines = tuple({"part": n, **orjson.loads(part.line)} for n, part in enumerate(parts))
    return read_result(run_batch(Task(lines, store, LIMITS, 60.0).write()))


def store_file(store: str, content: bytes, format: str = "npy") -> str:
    """Stores a file; returns its id."""

    async def keep() -> str:
        files = JobFiles(open_store(store, 0).backend)
        sources = SourceFiles(files, JobUsage(files, 0), 1e6)
        id, _ = await sources.store(content, BY_NAME[format])
        return id

    return asyncio.run(keep())


def test_a_part_has_the_bytes_of_the_call_and_is_found_again(store: str, client: Client) -> None:
    assert store_file(store, NET) == ID
    part = check(PATH)
    result = run(store, part)
    assert result.records[0]["state"] == "succeeded"
    response = client.request("POST", PATH, NET, {"Content-Type": NPY})
    _, content = read_object((Path(store) / part_key(part.id)).read_bytes())
    assert content == response.content
    assert run(store, part).records[0]["found"]


@pytest.mark.parametrize(
    ("path", "query"),
    [("/v1/measure", "?tolerance=0.001"), ("/v1/convert", '?operations=[{"op":"transpose"}]'),
     ("/v1/convert", "?up=z"), ("/v1/convert", "?format=iges&name=net")],
)  # fmt: skip
def test_other_calls_take_files_too(store: str, client: Client, path: str, query: str) -> None:
    store_file(store, NET)
    part = check(path + query)
    assert run(store, part).records[0]["state"] == "succeeded"
    response = client.request("POST", path + query, NET, {"Content-Type": NPY})
    assert response.status_code == 200
    _, content = read_object((Path(store) / part_key(part.id)).read_bytes())
    assert content == response.content


def test_an_id_depends_on_the_bytes_the_format_and_all_values() -> None:
    ids = {
        check(PATH).id,
        check(f"{PATH}&up=z").id,
        check("/v1/mesh?format=stl&resolution=3&name=net").id,
        check("/v1/mesh?format=glb&resolution=4&name=net").id,
        check("/v1/mesh?format=glb&resolution=3").id,
        check("/v1/measure?name=net").id,
        check(PATH, f"{'0' * 64}.npy").id,
        check(PATH, ID.replace("npy", "teapot")).id,
    }
    assert len(ids) == 8
    same = check("/v1/mesh?name=net&resolution=3,3&format=glb&faces=triangles", name="other").id
    assert same == check(PATH).id


def test_the_id_is_known_before_the_file_is_read() -> None:
    npy = BY_NAME["npy"]
    part = read_file_part(PATH, npy, NET, LIMITS)
    assert part.id == file_part_id(PATH, npy, NET, LIMITS) == check(PATH).id


REFUSALS = [
    ("/v1/points", ID, "unknown_path", "/path"),
    ("/v1/surfaces/saddle/mesh.glb", ID, "unknown_path", "/path"),
    ("/v1/mesh?resolution=0", ID, "out_of_range", "/path"),
    ("/v1/mesh?colour=red", ID, "unknown_field", "/path"),
    ("/v1/mesh?up=x", ID, "wrong_value", "/path"),
    ("/v1/mesh?format=xyz", ID, "unknown_format", "/path"),
    ("/v1/mesh?invalid_faces=skip", ID, "unknown_field", "/path"),
    ("/v1/mesh?degree=3", f"{'0' * 64}.step", "unknown_field", "/path"),
    ("/v1/mesh?invalid_faces=keep", f"{'0' * 64}.step", "wrong_value", "/path"),
    ("/v1/convert?operations=x", ID, "malformed_json", "/path"),
    ("/v1/mesh", f"{'0' * 64}.brep", "unknown_file", "/file"),
    ("/v1/mesh", "../../etc/passwd", "wrong_value", "/file"),
]


@pytest.mark.parametrize(("path", "id", "code", "pointer"), REFUSALS)
def test_parts_are_refused_before_their_file_is_read(
    path: str, id: str, code: str, pointer: str
) -> None:
    with pytest.raises(InvalidRequest) as caught:
        check(path, id)
    issue = caught.value.issues[0]
    assert (issue.code, issue.pointer) == (code, pointer)


@pytest.mark.parametrize("id", ["", "x", ID[:64], f"{ID}\n", ID.upper(), "part.step"])
def test_other_strings_than_ids_of_files_are_refused(id: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        check(PATH, id)
    issue = caught.value.issues[0]
    assert (issue.code, issue.pointer) == ("wrong_value", "/file")
    assert issue.message == "This is not the id of a file."
    assert "POST /v1/files" in issue.needed


def test_a_part_has_a_body_or_a_file() -> None:
    with pytest.raises(InvalidRequest) as caught:
        check("/v1/mesh", body={"surface": {}})
    assert caught.value.issues[0].code == "conflicting_options"


def test_errors_of_the_file_point_into_the_file(store: str) -> None:
    flat = np.zeros((2, 2, 2))
    nan = build_net()
    nan[0, 0, 0] = np.nan
    id, other = (store_file(store, save_array(array)) for array in (flat, nan))
    result = run(store, check(PATH, id), check(PATH, other), check(f"{PATH}&type=tube", ID))
    issues = [record["error"]["issues"][0] for record in result.records]
    assert (issues[0]["code"], issues[0]["pointer"]) == ("wrong_dimension", "/file")
    assert (issues[1]["code"], issues[1]["pointer"]) == (
        "not_finite",
        "/file/surface/control_net/0/0/0",
    )
    assert (issues[2]["code"], issues[2]["pointer"]) == ("unknown_file", "/file")


def test_a_damaged_file_fails_its_part(store: str) -> None:
    store_file(store, NET)
    (Path(store) / file_key(ID)).write_bytes(NET[:-1])
    assert run(store, check(PATH)).records[0]["error"]["class"] == "DamagedObject"


def test_calls_that_read_files_have_a_surface() -> None:
    assert {path for path, call in CALLS.items() if call.reads_files} == {
        "/v1/mesh",
        "/v1/image",
        "/v1/measure",
        "/v1/convert",
    }


@pytest.mark.parametrize(
    "id", ["", "x", "../" + "a" * 64, "a" * 64, f"{'A' * 64}.step", f"{'a' * 64}./"]
)
def test_only_ids_become_keys(id: str) -> None:
    with pytest.raises(ValueError, match="id of a file"):
        file_key(id)
    assert FILE_ID.fullmatch(ID)


class Aged(Bucket):
    """A backend whose objects were written long ago, until they are written again."""

    age = 0.0

    async def head(self, key: str) -> Entry:
        entry = await super().head(key)
        return entry._replace(modified=entry.modified - self.age)

    async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:
        object.__setattr__(self, "age", 0.0)
        await super().write(key, content, durable=durable)


def test_a_file_that_a_job_names_gets_younger() -> None:
    async def run() -> None:
        backend = Aged(MemoryStore())
        files = JobFiles(backend)
        sources = SourceFiles(files, JobUsage(files, 0), lifetime=100.0)
        id, is_new = await sources.store(NET, BY_NAME["npy"])
        assert (id, is_new) == (ID, True)
        assert await sources.store(NET, BY_NAME["npy"]) == (ID, False)
        object.__setattr__(backend, "age", 40.0)
        assert await sources.find_size(ID) == len(NET)
        assert backend.age == 40.0
        object.__setattr__(backend, "age", 60.0)
        assert await sources.find_size(ID) == len(NET)
        assert backend.age == 0.0
        with pytest.raises(InvalidRequest):
            await sources.find_size(f"{'0' * 64}.npy")

    asyncio.run(run())


def test_the_quota_of_jobs_counts_files() -> None:
    async def run() -> None:
        files = JobFiles(Bucket(MemoryStore()))
        usage = JobUsage(files, len(NET) + 10)
        sources = SourceFiles(files, usage, lifetime=100.0)
        await usage.recount()
        await sources.store(NET, BY_NAME["npy"])
        assert usage.used == len(NET)
        with pytest.raises(JobQuotaFull):
            await sources.store(NET + b" ", BY_NAME["npy"])
        await usage.recount()
        assert usage.used == len(NET)

    asyncio.run(run())
