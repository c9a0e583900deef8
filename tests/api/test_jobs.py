"""Jobs over HTTP: how they are asked for, watched, read and withdrawn."""

import asyncio
import inspect
import re
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from hashlib import sha256
from typing import Any, NamedTuple

import fastapi.sse
import httpx
import orjson
import pytest

from service.api.app import Application, create_app
from service.api.guard.keys import KeyScope, format_entry, make_key
from service.api.routes.job_events import get_job_events
from service.engine.mesh.mesh import ENGINE
from service.errors import Issue, JobQuotaFull, StoreFailed, TooLarge, TooManyJobs
from service.jobs.state import JobState
from service.settings.values import Settings
from service.storage.canonical import canonical_content, surface_id
from service.surface.examples.catalogue import find
from tests.api.fake_jobs import FakeJobs
from tests.forms import PATCH
from tools.client import Client, start_client

LID = {"name": "lid", "path": "/v1/mesh?format=glb", "body": {"surface": PATCH}}
HULL = {"name": "hull", "path": "/v1/surfaces/ship-hull/mesh.stl?resolution=8"}
JOB = {"parts": [LID, HULL]}
NDJSON = {"Content-Type": "application/x-ndjson"}
ASYNC = {"Prefer": "respond-async"}
TRIANGLE = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}
STORED = surface_id(canonical_content(find("saddle").surface()))


RAYS = {"origins": [[0, 0, 1]], "directions": [[0, 0, -1]]}


def mesh_part(**body: Any) -> dict[str, Any]:
    """A part that is a mesh, with this body."""
    return {"path": "/v1/mesh", "body": body}


class Service(NamedTuple):
    """A service with jobs in memory."""

    client: Client
    jobs: FakeJobs
    app: Application


def start_service(settings: Settings) -> Iterator[Service]:
    app, jobs = create_app(settings), FakeJobs()
    app.state.services = replace(app.state.services, jobs=jobs)
    with start_client(app) as client:
        yield Service(client, jobs, app)


@pytest.fixture
def service() -> Iterator[Service]:
    yield from start_service(Settings())


def post_lines(client: Client, *lines: bytes) -> httpx.Response:
    """Sends lines; each piece arrives alone."""
    return client.request("POST", "/v1/jobs", lines, NDJSON)


def write_lines(parts: list[Any]) -> bytes:
    return b"".join(orjson.dumps(part, option=orjson.OPT_APPEND_NEWLINE) for part in parts)


def start_job(service: Service) -> str:
    return str(service.client.post("/v1/jobs", JOB).json()["id"])


def find_pointer(response: httpx.Response) -> tuple[str, str]:
    error = response.json()["errors"][0]
    return error["code"], error["pointer"]


def test_a_job_is_accepted_and_its_state_can_be_asked_for(service: Service) -> None:
    response = service.client.post("/v1/jobs", JOB)
    id = response.json()["id"]
    assert response.status_code == 202
    assert response.headers["location"] == f"/v1/jobs/{id}"
    assert response.headers["retry-after"] == "1"
    assert response.headers["cache-control"] == "no-store"
    assert response.json() == {
        "id": id,
        "state": "queued",
        "engine": ENGINE,
        "parts": {"total": 2, "queued": 2, "running": 0, "succeeded": 0, "failed": 0},
        "created": "2026-11-29T14:40:20.125Z",
        "started": None,
        "ended": None,
        "expires": "2026-12-06T14:40:20.125Z",
        "rate": 0.0,
        "seconds_left": None,
        "links": {
            "self": f"/v1/jobs/{id}",
            "events": f"/v1/jobs/{id}/events",
            "results": f"/v1/jobs/{id}/results",
        },
    }
    state = service.client.get(f"/v1/jobs/{id}")
    assert state.json() == response.json()
    assert state.headers["retry-after"] == "1"


def test_a_second_request_joins_and_gets_200_once_all_parts_succeeded(
    service: Service,
) -> None:
    id = start_job(service)
    assert service.client.post("/v1/jobs", JOB).status_code == 202
    for part in (0, 1):
        service.jobs.end_part(id, part, b"mesh")
    response = service.client.post("/v1/jobs", JOB)
    assert (response.status_code, response.json()["state"]) == (200, "succeeded")
    assert "retry-after" not in response.headers
    assert "retry-after" not in service.client.get(f"/v1/jobs/{id}").headers


def test_the_reason_for_which_a_job_waits_is_named_while_it_waits(service: Service) -> None:
    id = start_job(service)
    service.jobs.states[id] = replace(service.jobs.states[id], waiting_for="disk_full")
    assert service.client.get(f"/v1/jobs/{id}").json()["waiting_for"] == "disk_full"


def test_the_same_parts_as_lines_with_other_names_are_the_same_job(service: Service) -> None:
    id = start_job(service)
    lines = write_lines([LID | {"name": "top"}, HULL])
    for pieces in ([lines], [lines[:-1]], [lines[i : i + 7] for i in range(0, len(lines), 7)]):
        response = post_lines(service.client, *pieces)
        assert (response.status_code, response.json()["id"]) == (202, id)
    assert len(service.jobs.states) == 1


def test_lines_are_checked_in_batches_while_they_arrive(service: Service) -> None:
    part = {"path": "/v1/surfaces/saddle/mesh.glb"}
    parts = [part | {"path": f"{part['path']}?resolution={k}"} for k in range(1, 151)]
    response = post_lines(service.client, write_lines(parts))
    assert response.json()["parts"]["total"] == 150
    assert service.jobs.batches == [64, 64, 22]


@pytest.mark.parametrize(
    ("part", "code", "pointer"),
    [
        (mesh_part(surface={}), "missing_field", "/body/surface/control_net"),
        (mesh_part(surface=PATCH, resolution=0), "out_of_range", "/body/resolution"),
        (LID | {"path": "/v1/mesh?format=fbx"}, "unknown_format", "/path"),
        (LID | {"path": "/v1/estimate"}, "unknown_path", "/path"),
        ({"path": "/v1/surfaces/sadle/mesh.glb"}, "unknown_path", "/path"),
        ({"path": f"/v1/surfaces/{'0' * 64}/mesh.glb"}, "unknown_surface", "/path"),
        ({"path": "/v1/surfaces/saddle/mesh.glb?resolution=0"}, "out_of_range", "/path"),
        ({"name": "x", "path": "/v1/mesh", "size": 1}, "unknown_field", "/size"),
        ({}, "missing_field", "/path"),
        (1, "wrong_type", ""),
    ],
)  # fmt: skip
def test_a_part_is_refused_with_its_index_in_both_forms(
    service: Service, part: Any, code: str, pointer: str
) -> None:
    parts = [HULL, HULL, HULL, part]
    for response in (
        service.client.post("/v1/jobs", {"parts": parts}),
        post_lines(service.client, write_lines(parts)),
    ):
        assert response.status_code == 422
        assert find_pointer(response) == (code, f"/parts/3{pointer}")
    assert service.jobs.states == {}


def test_lines_that_are_no_json_are_refused_with_their_index(service: Service) -> None:
    first = write_lines([HULL])
    for line in (b"{", b"\n", b'{"path": 1, "path": 1}', b"\xff\n"):
        response = post_lines(service.client, first + line)
        assert response.status_code in (400, 422)
        assert find_pointer(response)[1].startswith("/parts/1")
    assert service.jobs.discarded == 4


@pytest.mark.parametrize("body", [{}, {"parts": []}, {"parts": {}}, {"parts": [HULL], "name": "x"}])
def test_documents_of_another_form_are_refused(service: Service, body: Any) -> None:
    assert service.client.post("/v1/jobs", body).status_code == 422


def test_a_body_without_lines_is_refused(service: Service) -> None:
    for body in (b"", b" \n".strip(b"\n")):
        assert find_pointer(post_lines(service.client, body)) == ("empty_list", "/parts")


def test_parts_may_name_stored_surfaces(service: Service) -> None:
    service.client.post("/v1/surfaces", service.client.get("/v1/surfaces/saddle").json())
    parts = [{"path": f"/v1/surfaces/{STORED}/mesh.glb?resolution={k}"} for k in (1, 2)]
    assert service.client.post("/v1/jobs", {"parts": parts}).status_code == 202


def start_limited(**limits: Any) -> Iterator[Service]:
    return start_service(Settings(**limits))


def test_bodies_of_lines_have_limits_of_their_own() -> None:
    long_name = {"name": "x" * 100, **{k: v for k, v in HULL.items() if k != "name"}}
    for service in start_limited(max_job_bytes=2048, max_json_bytes=1024):
        cases = [
            (b" " * 1025, "a line of more than 1024 bytes"),
            (write_lines([long_name]) * 20, "more than 2048 bytes"),
        ]
        for lines, got in cases:
            pieces = [lines[i : i + 100] for i in range(0, len(lines), 100)]
            response = post_lines(service.client, *pieces)
            assert response.status_code == 413
            assert response.json()["errors"][0]["got"] == got
        headers = NDJSON | {"Content-Length": "9" * 30}
        assert service.client.request("POST", "/v1/jobs", b"", headers).status_code == 413
        headers = NDJSON | {"Content-Encoding": "gzip"}
        assert service.client.request("POST", "/v1/jobs", b"", headers).status_code == 415
        assert service.jobs.states == {}


def test_a_body_that_stalls_is_refused_and_leaves_nothing() -> None:
    async def send_half() -> Any:
        yield write_lines([HULL])
        await asyncio.sleep(30)

    for service in start_limited(body_timeout=0.05):
        response = service.client.request("POST", "/v1/jobs", send_half(), NDJSON)
        assert response.status_code == 408
        assert service.jobs.discarded == 1


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (TooManyJobs(Issue("too_many_jobs", "Too many.")), 429, "too_many_jobs"),
        (JobQuotaFull(Issue("job_quota_full", "Full.")), 507, "job_quota_full"),
    ],
)
def test_jobs_are_refused_with_problems(
    service: Service, error: TooManyJobs | JobQuotaFull, status: int, code: str
) -> None:
    service.jobs.error = error
    response = service.client.post("/v1/jobs", JOB)
    assert (response.status_code, response.json()["code"]) == (status, code)
    assert ("retry-after" in response.headers) == (status == 429)


def test_a_call_makes_a_job_of_one_part_if_the_client_prefers_that(service: Service) -> None:
    body = {"surface": PATCH, "resolution": 3}
    response = service.client.post("/v1/mesh?format=glb", body, ASYNC)
    assert response.status_code == 202
    assert response.headers["preference-applied"] == "respond-async"
    part = {"path": "/v1/mesh?format=glb", "body": body}
    job = service.client.post("/v1/jobs", {"parts": [part]})
    assert job.json()["id"] == response.json()["id"]
    assert "preference-applied" not in job.headers


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/v1/points", {"surface": PATCH, "uv": [[0.5, 0.5]]}),
        ("/v1/curve", {"curve": {"control_points": [[0, 0, 0], [1, 1, 0]]}}),
        ("/v1/project", {"surface": PATCH, "points": [[0, 0, 1]]}),
        ("/v1/intersect", {"surface": PATCH, "rays": RAYS}),
        ("/v1/measure", {"surface": PATCH}),
        ("/v1/check", {"surface": PATCH, "mesh": TRIANGLE}),
        ("/v1/convert", {"surface": PATCH, "operations": [{"op": "elevate", "degree": [2, 2]}]}),
    ],
)  # fmt: skip
def test_every_call_that_computes_can_be_a_job(service: Service, path: str, body: Any) -> None:
    for prefer in ("respond-async", "wait=10, Respond-Async", "respond-async; x=1"):
        response = service.client.post(path, body, {"Prefer": prefer})
        assert response.status_code == 202, response.text
        job = service.client.post("/v1/jobs", {"parts": [{"path": path, "body": body}]})
        assert job.json()["id"] == response.json()["id"]


def test_errors_of_a_call_that_would_be_a_job_have_the_pointers_of_the_call(
    service: Service,
) -> None:
    body = {"surface": PATCH, "resolution": 0}
    response = service.client.post("/v1/mesh", body, ASYNC)
    assert response.status_code == 422
    assert response.json() == service.client.post("/v1/mesh", body).json()


def test_other_preferences_calls_and_files_are_answered_at_once(service: Service) -> None:
    body = {"surface": PATCH}
    for prefer in ("wait=1", "respond-asynchronously", "x=respond-async"):
        assert service.client.post("/v1/mesh", body, {"Prefer": prefer}).status_code == 200
    assert service.client.post("/v1/estimate", body, ASYNC).status_code == 200
    file = b"1\n1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16\n16\n" + b"".join(
        b"%d,%d,0\n" % divmod(k, 4) for k in range(16)
    )
    headers = ASYNC | {"Content-Type": "text/x-unknown"}
    response = service.client.request("POST", "/v1/mesh", file, headers)
    assert "preference-applied" not in response.headers
    assert response.status_code in (200, 415)
    assert service.jobs.states == {}


def test_results_are_listed_with_their_files_and_problems(service: Service) -> None:
    id = start_job(service)
    service.jobs.end_part(id, 0, b"glTF")
    error = TooLarge(Issue("too_many_vertices", "Too many.", "/path", "5", "at most 4"))
    service.jobs.end_part(id, 1, error)
    listed = service.client.get(f"/v1/jobs/{id}/results").json()
    assert listed == {
        "results": [
            {
                "part": 0,
                "name": "lid",
                "state": "succeeded",
                "media_type": "model/gltf-binary",
                "bytes": 4,
                "sha256": sha256(b"glTF").hexdigest(),
                "link": f"/v1/jobs/{id}/results/0",
            },
            {
                "part": 1,
                "name": "hull",
                "state": "failed",
                "problem": {
                    "type": "about:blank",
                    "title": "Unprocessable Content",
                    "status": 422,
                    "code": "result_too_large",
                    "detail": "The result would exceed a limit.",
                    "errors": [
                        {
                            "code": "too_many_vertices",
                            "pointer": "/parts/1/path",
                            "detail": "Too many.",
                            "got": "5",
                            "needed": "at most 4",
                        }
                    ],
                },
            },
        ]
    }
    first = service.client.get(f"/v1/jobs/{id}/results?limit=1").json()
    assert [each["part"] for each in first["results"]] == [0]
    second = service.client.get(first["next"]).json()
    assert [each["part"] for each in second["results"]] == [1]
    assert "next" not in second
    assert service.client.get(f"/v1/jobs/{id}/results?from=7").json() == {"results": []}


@pytest.mark.parametrize(
    "query", ["from=-1", "limit=0", "limit=1001", "from=x", "a=1", "from=0&from=1"]
)
def test_an_invalid_range_is_refused(service: Service, query: str) -> None:
    response = service.client.get(f"/v1/jobs/{start_job(service)}/results?{query}")
    assert response.status_code == 422
    assert response.json()["errors"][0]["parameter"] == query.partition("=")[0]


def test_a_part_without_a_name_has_its_index_as_name(service: Service) -> None:
    parts = [{key: part[key] for key in part if key != "name"} for part in (LID, HULL)]
    id = service.client.post("/v1/jobs", {"parts": parts}).json()["id"]
    listed = service.client.get(f"/v1/jobs/{id}/results").json()["results"]
    assert [(each["name"], each["state"]) for each in listed] == [("0", "queued"), ("1", "queued")]


def test_the_file_of_a_part_is_sent_once_it_is_there_and_never_changes(service: Service) -> None:
    id = start_job(service)
    url = f"/v1/jobs/{id}/results/0"
    assert service.client.get(url).status_code == 404
    service.jobs.end_part(id, 0, content := b"glTF" * 50_000)
    response = service.client.get(url)
    assert (response.status_code, response.content) == (200, content)
    tag = f'"{sha256(content).hexdigest()}"'
    expected = {
        "content-type": "model/gltf-binary",
        "content-length": str(len(content)),
        "content-disposition": 'attachment; filename="lid.glb"',
        "etag": tag,
        "cache-control": "public, max-age=31536000, immutable",
        "surface-vertices": "4",
        "surface-triangles": "2",
        "surface-deviation-bound": "0.5",
    }
    assert expected.items() <= dict(response.headers).items()
    head = service.client.request("HEAD", url)
    assert head.content == b""
    assert head.headers == response.headers
    for condition in (tag, f'"x", W/{tag}', "*"):
        unchanged = service.client.get(url, {"If-None-Match": condition})
        assert (unchanged.status_code, unchanged.content) == (304, b"")
        assert unchanged.headers["etag"] == tag
    assert service.client.get(url, {"If-None-Match": '"x"'}).status_code == 200
    assert service.app.state.services.threads.used_bytes == 0


def test_a_result_is_read_when_there_is_memory_for_it(service: Service) -> None:
    id = start_job(service)
    service.jobs.end_part(id, 0, b"glTF")
    threads = service.app.state.services.threads

    async def get() -> httpx.Response:
        threads.hold(threads.capacity)
        url = f"/v1/jobs/{id}/results/0"
        request = asyncio.create_task(service.client._request("GET", url, None, None))
        while not threads.queue_length:
            await asyncio.sleep(0)
        assert service.jobs.read_count == 0
        threads.hold(-threads.capacity)
        return await request

    states_before = service.jobs.state_count
    assert service.client.call(get).content == b"glTF"
    assert service.jobs.read_count == 1
    assert service.jobs.state_count == states_before + 1


@pytest.mark.parametrize("part", ["2", "-1", "x", "0x0", "9" * 30])
def test_unknown_parts_are_not_found(service: Service, part: str) -> None:
    response = service.client.get(f"/v1/jobs/{start_job(service)}/results/{part}")
    assert (response.status_code, response.json()["code"]) == (404, "unknown_result")
    assert response.json()["errors"][0]["parameter"] == "part"


@pytest.mark.parametrize("path", ["", "/events", "/results", "/results/0"])
def test_unknown_jobs_are_not_found(service: Service, path: str) -> None:
    for id in ("0" * 64, "x"):
        response = service.client.get(f"/v1/jobs/{id}{path}")
        assert (response.status_code, response.json()["code"]) == (404, "unknown_job")
        assert response.json()["errors"][0]["parameter"] == "id"
    assert service.client.request("DELETE", f"/v1/jobs/{'0' * 64}").status_code == 404


def read_events(text: str) -> list[tuple[str, Any]]:
    """The events of a stream: name and data of each."""
    fields = [
        dict(re.findall(r"^(\w+): (.*)$", event, re.MULTILINE)) for event in text.split("\n\n")
    ]
    return [(each["event"], orjson.loads(each["data"])) for each in fields if each]


def test_events_tell_the_progress_and_the_end(service: Service) -> None:
    id = start_job(service)

    async def end_parts() -> None:
        for part in (0, 1):
            await asyncio.sleep(0.02)
            service.jobs.end_part(id, part, b"mesh")

    async def watch() -> httpx.Response:
        ending = asyncio.create_task(end_parts())
        response = await service.client._request("GET", f"/v1/jobs/{id}/events", None, None)
        await ending
        return response

    response = service.client.call(watch)
    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/event-stream")
    assert response.headers["cache-control"] == "no-cache"
    events = read_events(response.text)
    assert [name for name, _ in events] == ["progress", "progress", "end"]
    assert [data["parts"]["succeeded"] for _, data in events] == [0, 1, 2]
    assert events[-1][1] == service.client.get(f"/v1/jobs/{id}").json()
    assert "retry: 1000\n" in response.text


def test_the_events_of_a_job_that_has_ended_are_its_end(service: Service) -> None:
    id = start_job(service)
    for part in (0, 1):
        service.jobs.end_part(id, part, b"mesh")
    events = read_events(service.client.get(f"/v1/jobs/{id}/events").text)
    assert [name for name, _ in events] == ["end"]


def test_comments_keep_a_stream_open_between_events(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    id = start_job(service)
    path = f"/v1/jobs/{id}/events"
    # The documentation promises these seconds, for which no test waits.
    assert fastapi.sse._PING_INTERVAL == 15.0
    assert "a comment every 15 s" in inspect.cleandoc(str(get_job_events.__doc__)).replace(
        "\n", " "
    )
    monkeypatch.setattr("fastapi.routing._PING_INTERVAL", 0.01)

    async def watch() -> httpx.Response:
        watching = asyncio.create_task(service.client._request("GET", path, None, None))
        await asyncio.sleep(0.1)
        service.app.state.ready = False
        return await watching

    text = service.client.call(watch).text
    assert [name for name, _ in read_events(text)] == ["progress"]
    assert text.count(": ping\n\n") > 1


def test_a_stream_ends_when_the_service_is_about_to_stop(service: Service) -> None:
    id = start_job(service)
    service.app.state.ready = False
    response = service.client.get(f"/v1/jobs/{id}/events")
    assert [name for name, _ in read_events(response.text)] == ["progress"]


def test_the_head_of_a_stream_ends_at_once(service: Service) -> None:
    response = service.client.request("HEAD", f"/v1/jobs/{start_job(service)}/events")
    assert (response.status_code, response.content) == (200, b"")


def test_a_withdrawn_job_is_cancelled_and_still_has_a_state(service: Service) -> None:
    id = start_job(service)
    response = service.client.request("DELETE", f"/v1/jobs/{id}")
    assert (response.status_code, response.content) == (204, b"")
    assert service.client.get(f"/v1/jobs/{id}").json()["state"] == "cancelled"


def test_paths_of_jobs_take_no_parameters(service: Service) -> None:
    id = start_job(service)
    service.jobs.end_part(id, 0, b"mesh")
    for path in ("", f"/{id}", f"/{id}/events", f"/{id}/results/0"):
        assert service.client.get(f"/v1/jobs{path}?x=1").status_code == 422
    assert service.client.request("DELETE", f"/v1/jobs/{id}?x=1").status_code == 422
    assert service.client.post("/v1/jobs?x=1", JOB).status_code == 422
    response = service.client.request("POST", "/v1/jobs?x=1", write_lines([HULL]), NDJSON)
    assert response.status_code == 422


def test_jobs_can_be_switched_off() -> None:
    with start_client(create_app(Settings(jobs=False))) as client:
        assert client.post("/v1/jobs", JOB).status_code == 404
        assert client.post("/v1/mesh", {"surface": PATCH}, ASYNC).status_code == 200
        assert "/v1/jobs" not in client.get("/openapi.json").json()["paths"]


def with_keys(
    *scopes: frozenset[KeyScope], **settings: Any
) -> tuple[list[dict[str, str]], Settings]:
    keys = [make_key() for _ in scopes]
    names = ("alice", "bob", "root")
    entries = tuple(format_entry(n, k, s) for n, k, s in zip(names, keys, scopes, strict=False))
    return [{"Authorization": f"Bearer {k}"} for k in keys], Settings(api_keys=entries, **settings)


USER: frozenset[KeyScope] = frozenset({"read", "compute"})


def test_callers_see_their_own_jobs_and_admins_all() -> None:
    (alice, bob, root), settings = with_keys(USER, USER, USER | {"admin"})
    for service in start_service(settings):
        assert service.client.post("/v1/jobs", JOB).status_code == 401
        id = service.client.post("/v1/jobs", JOB, alice).json()["id"]
        assert service.client.get("/v1/jobs").status_code == 401

        def list_ids(headers: dict[str, str], service: Service = service) -> list[str]:
            return [job["id"] for job in service.client.get("/v1/jobs", headers).json()["jobs"]]

        assert list_ids(alice) == list_ids(root) == [id]
        assert list_ids(bob) == []
        # The id permits to read, as that of a surface does; to withdraw needs a key.
        assert service.client.get(f"/v1/jobs/{id}").status_code == 200
        assert service.client.request("DELETE", f"/v1/jobs/{id}").status_code == 401
        assert service.client.request("DELETE", f"/v1/jobs/{id}", headers=bob).status_code == 204
        assert service.jobs.askers[id] == {"key alice"}


def test_a_key_without_the_scope_makes_no_jobs() -> None:
    (reader,), settings = with_keys(frozenset({"read"}))
    for service in start_service(settings):
        assert service.client.post("/v1/jobs", JOB, reader).status_code == 403


def test_reads_that_are_not_public_need_a_key_and_are_not_cached_by_others() -> None:
    (alice,), settings = with_keys(USER, public_reads=False)
    for service in start_service(settings):
        id = service.client.post("/v1/jobs", JOB, alice).json()["id"]
        service.jobs.end_part(id, 0, b"mesh")
        for path in ("", "/events", "/results", "/results/0"):
            assert service.client.get(f"/v1/jobs/{id}{path}").status_code == 401
        response = service.client.get(f"/v1/jobs/{id}/results/0", alice)
        assert response.status_code == 200
        assert response.headers["cache-control"] == "private, no-cache"


def test_without_keys_the_address_is_the_caller(service: Service) -> None:
    id = start_job(service)
    assert [job["id"] for job in service.client.get("/v1/jobs").json()["jobs"]] == [id]


def test_pages_of_other_origins_may_not_list_the_jobs_of_an_address(service: Service) -> None:
    """The address of its visitor would be the only permission that such a page has."""
    origin = {"Origin": "https://example.org"}
    id = start_job(service)
    assert "access-control-allow-origin" not in service.client.get("/v1/jobs", origin).headers
    for response in (
        service.client.post("/v1/jobs", JOB, origin),
        service.client.get(f"/v1/jobs/{id}", origin),
        service.client.get("/v1/jobs", origin | {"Authorization": "Bearer key"}),
    ):
        assert response.headers["access-control-allow-origin"] == "*"
    request = origin | {"Access-Control-Request-Method": "DELETE"}
    # A preflight request has no key. The request after it may have one, or start a job.
    preflight = service.client.request("OPTIONS", "/v1/jobs", headers=request)
    assert preflight.headers["access-control-allow-origin"] == "*"
    preflight = service.client.request("OPTIONS", f"/v1/jobs/{id}", headers=request)
    assert "DELETE" in preflight.headers["access-control-allow-methods"]
    assert "Prefer" in preflight.headers["access-control-allow-headers"]
    other = service.client.request("OPTIONS", f"/v1/surfaces/{id}", headers=request)
    assert "DELETE" not in other.headers["access-control-allow-methods"]


def test_labels_have_no_ids_of_jobs(service: Service) -> None:
    id = start_job(service)
    labels = service.app.outermost.labels  # type: ignore[attr-defined]
    for path in ("", "/events", "/results", "/results/0"):
        label = labels.find(f"/v1/jobs/{id}{path}")
        assert label.surface == ""
        assert id not in label.path
        assert label.route.startswith("/v1/jobs/{id}")


def test_a_stream_ends_when_the_store_fails(
    service: Service, caplog: pytest.LogCaptureFixture
) -> None:
    id = start_job(service)

    async def fail(id: str) -> AsyncIterator[JobState]:
        yield service.jobs.states[id]
        raise StoreFailed

    service.jobs.watch = fail  # type: ignore[method-assign, assignment]
    events = read_events(service.client.get(f"/v1/jobs/{id}/events").text)
    assert [name for name, _ in events] == ["progress"]
    assert [each.levelname for each in caplog.records if each.levelname == "ERROR"] == []
