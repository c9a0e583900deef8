"""The TypeScript client on Node: calls, errors, retries, keys, jobs, the queue, and geometries."""

import gzip
import json
import re
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler
from pathlib import Path
from typing import Any

import httpx
import pytest

from service import __version__
from service.api.guard.keys import format_entry, make_key
from service.client import calls as python_calls
from service.client.call import Call
from service.decoders.mesh_registry import MESH_BY_NAME
from service.decoders.registry import DECODERS
from service.engine.mesh.mesh import ENGINE
from service.settings.values import Settings
from tests.web.typescript import ROOT, SOURCES, compile_program, evaluate, install_package
from tools.browser import FOLDER
from tools.live import run_service, serve

SADDLE = {"control_net": [[[-1, -1, 1], [-1, 1, -1]], [[1, -1, -1], [1, 1, 1]]]}
TRIANGLE = {"vertices": [[1, -1, -1], [1, 1, 1], [-1, -1, 1]], "faces": [[0, 1, 2]]}
KEY = make_key()
MAX_BYTES = 15_000
USES = (FOLDER / "client_uses.ts").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("typescript")
    install_package(folder)
    return folder


class Script:
    """The responses that a server sends, one after the other; and the requests that it got."""

    def __init__(self) -> None:
        self.responses: list[tuple[int, dict[str, str], str]] = []
        self.requests: list[tuple[str, str, dict[str, str]]] = []

    def answer(self, status: int, body: object = None, **headers: str) -> None:
        """Adds a response; `body` is JSON, and that of an error a problem document."""
        media_type = "application/problem+json" if status >= 400 else "application/json"
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        self.responses.append((status, {"Content-Type": media_type} | named, json.dumps(body)))


@pytest.fixture
def script() -> Script:
    return Script()


@pytest.fixture
def scripted(script: Script) -> Iterator[str]:
    """The URL of a server that sends the responses of the script; the last one again and again."""

    class Handler(BaseHTTPRequestHandler):
        def respond(self) -> None:
            self.rfile.read(int(self.headers.get("Content-Length", 0)))
            headers = {name.lower(): value for name, value in self.headers.items()}
            script.requests.append((self.command, self.path, headers))
            status, named, body = script.responses[0]
            del script.responses[: len(script.responses) > 1]
            self.send_response(status)
            for name, value in named.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body.encode())

        do_GET = do_POST = do_DELETE = respond  # noqa: N815

        def log_message(self, format: str, *args: Any) -> None:
            """Writes no log."""

    with serve(Handler) as url:
        yield url


def busy(code: str = "busy", status: int = 503) -> dict[str, Any]:
    return {"status": status, "code": code, "title": "Busy", "detail": "Try again.", "errors": []}


# The package


def test_the_module_is_small_and_imports_nothing(folder: Path) -> None:
    package = folder / "node_modules" / "surface-service"
    module = (package / "index.js").read_bytes()
    assert len(module) <= MAX_BYTES
    assert len(gzip.compress(module, 9)) <= MAX_BYTES / 3
    assert not re.search(rb"\b(import|require)\b\s*[({'\"]", module)
    document = json.loads((package / "package.json").read_text(encoding="utf-8"))
    assert "dependencies" not in document
    assert document["version"] == __version__
    assert f"surface-service-{__version__}.tgz" in (ROOT / "docs" / "typescript.md").read_text()


def test_the_client_knows_the_suffixes_of_all_files_that_the_service_reads() -> None:
    source = (SOURCES / "src" / "body.ts").read_text(encoding="utf-8")
    table = source.split("MEDIA_TYPES", 1)[1].split("};", 1)[0]
    types = {suffix.strip("'"): media for suffix, media in re.findall(r"(\S+): '(\S+)'", table)}
    assert types == {suffix: d.media_type for d in DECODERS for suffix in d.suffixes}


@pytest.mark.parametrize("resolution", ["bundler", "nodenext"])
def test_strict_programs_compile_and_mistakes_do_not(folder: Path, resolution: str) -> None:
    """After `@ts-expect-error`, the compiler would report a mistake that the types accept."""
    module = "es2022" if resolution == "bundler" else resolution
    options = {"module": module, "moduleResolution": resolution, "exactOptionalPropertyTypes": True}
    # The types of three.js itself are not those that this test is about.
    errors, _ = compile_program(folder, USES, skipLibCheck=True, **options)
    assert errors == ""


# Calls


def test_the_client_has_the_calls_of_the_python_client() -> None:
    source = (SOURCES / "src" / "client.ts").read_text(encoding="utf-8")
    calls = set(re.findall(r"^  (?:async )?(\w+)\(", source, re.MULTILINE))
    names = {name for name, row in vars(python_calls).items() if isinstance(row, Call)}
    assert names
    assert names <= calls


CALLS: list[tuple[str, str, list[Any], dict[str, Any]]] = [
    ("mesh", "mesh", [SADDLE, {"resolution": 3}], {"surface": SADDLE, "resolution": 3}),
    ("estimate", "estimate", [SADDLE, {"resolution": 3}], {"surface": SADDLE, "resolution": 3}),
    ("points", "points", [SADDLE, {"uv": [[0.5, 1]]}], {"surface": SADDLE, "uv": [[0.5, 1]]}),
    ("measure", "measure", [SADDLE], {"surface": SADDLE}),
    (
        "check",
        "check",
        [SADDLE, TRIANGLE, {"distances": True}],
        {"surface": SADDLE, "mesh": TRIANGLE, "distances": True},
    ),
    ("store", "surfaces", [SADDLE], {"surface": SADDLE}),
    (
        "project",
        "project",
        [SADDLE, {"points": [[0, 0, 1]]}],
        {"surface": SADDLE, "points": [[0, 0, 1]]},
    ),
    (
        "project",
        "project",
        [{"curve": {"control_points": [[0, 0], [1, 1]]}}, {"points": [[1, 0]]}],
        {"curve": {"control_points": [[0, 0], [1, 1]]}, "points": [[1, 0]]},
    ),
    (
        "intersect",
        "intersect",
        [SADDLE, {"planes": {"normals": [[1, 0, 0]], "offsets": [0.25]}}],
        {"surface": SADDLE, "planes": {"normals": [[1, 0, 0]], "offsets": [0.25]}},
    ),
    (
        "convert",
        "convert",
        [SADDLE, {"operations": [{"op": "transpose"}]}],
        {"surface": SADDLE, "operations": [{"op": "transpose"}]},
    ),
    (
        "curve",
        "curve",
        [{"control_points": [[0, 0], [1, 1]]}, {"resolution": 2}],
        {"curve": {"control_points": [[0, 0], [1, 1]]}, "resolution": 2},
    ),
]


def test_calls_answer_as_the_service_does(folder: Path, server: str) -> None:
    """A call with a definition, and with the id of the same surface."""
    code = """const client = new SurfaceClient(argument.server);
        return Promise.all(argument.calls.map(([name, args]) => client[name](...args)));"""
    calls = [[name, arguments] for name, _, arguments, _ in CALLS]
    id = httpx.post(f"{server}/v1/surfaces", json={"surface": SADDLE}).json()["id"]
    by_id = [
        [name, [id, *arguments[1:]]]
        for name, arguments in calls
        if arguments[0] == SADDLE and name != "store"
    ]
    answers = evaluate(folder, code, {"server": server, "calls": calls + by_id})
    expected = [httpx.post(f"{server}/v1/{path}", json=body).json() for _, path, _, body in CALLS]
    assert answers[: len(calls)] == expected
    expected_by_id = [
        answer
        for answer, (name, _, arguments, _) in zip(expected, CALLS, strict=True)
        if arguments[0] == SADDLE and name != "store"
    ]
    assert answers[len(calls) :] == expected_by_id


def test_pictures_are_bytes(folder: Path, server: str) -> None:
    """The surface is an id, a definition or a file."""
    code = """const client = new SurfaceClient(argument.server);
        const file = new File(['BEZ113\\n0 0 0  1 0 0  0 1 1  1 1 0\\n'], 'net.BEZ');
        const view = { width: 20, height: 10, position: [3, 4, 5], target: [0, 0, 0], edges: true };
        const surfaces = ['saddle', argument.surface, { file, up: 'z' }];
        const pictures = await Promise.all(surfaces.map((each) => client.image(each, view)));
        return pictures.map((picture) => Array.from(new Uint8Array(picture)));"""
    pictures = evaluate(folder, code, {"server": server, "surface": SADDLE})
    query = "width=20&height=10&position=3,4,5&target=0,0,0&edges=true"
    expected = httpx.get(f"{server}/v1/surfaces/saddle/image.png?{query}").content
    assert bytes(pictures[0]) == expected
    assert all(bytes(picture).startswith(b"\x89PNG") for picture in pictures)


def test_meshes_are_files_beside_an_id_and_in_a_document(folder: Path, server: str) -> None:
    code = """const client = new SurfaceClient(argument.server);
        const text = 'OFF\\n3 1 0\\n1 -1 -1\\n1 1 1\\n-1 -1 1\\n3 0 1 2\\n';
        const file = new File([text], 'mesh.OFF');
        const options = { relative_tolerance: 0.2 };
        return [
            await client.check('saddle', { file }, options),
            await client.check(argument.saddle, { file: new Blob([text]), format: 'off' }, options),
            await client.check(argument.saddle, { file: btoa(text), format: 'off' }, options),
            await client.check(argument.saddle, argument.mesh, options),
            await client.check('saddle', { file: new Blob([text]) }).catch((error) => error.name),
        ];"""
    argument = {"server": server, "saddle": SADDLE, "mesh": TRIANGLE}
    *answers, error = evaluate(folder, code, argument)
    assert error == "TypeError"
    assert answers[0]["triangles"] == 1
    assert all(answer == answers[0] for answer in answers)


def test_the_client_knows_the_formats_of_meshes() -> None:
    source = (SOURCES / "src" / "body.ts").read_text(encoding="utf-8")
    table = source.split("MESH_TYPES", 1)[1].split("};", 1)[0]
    types = dict(re.findall(r"(\w+): '(\S+)'", table))
    assert types == {name: each.media_type for name, each in MESH_BY_NAME.items()}


def test_files_come_as_bytes_and_go_with_their_options(folder: Path, server: str) -> None:
    code = """const client = new SurfaceClient(argument);
        const file = new File(['BEZ113\\n0 0 0  1 0 0  0 1 1  1 1 0\\n'], 'net.BEZ');
        const glb = await client.mesh('saddle', { format: 'glb', resolution: [1, 2], engine: 4 });
        const step = await client.convert('saddle', { format: 'step' });
        const headers = [];
        const onResponse = (response) => headers.push(response.headers.get('Surface-Triangles'));
        const net = { file, up: 'z', name: 'a net' };
        const mesh = await client.mesh(net, { resolution: [1, 2] }, { onResponse });
        const turned = await client.convert(net, { operations: [{ op: 'transpose' }] });
        const { distances } = await client.project({ file }, { points: [[0, 0, 1]] });
        const list = await client.surfaces();
        return [
            new TextDecoder().decode(glb.slice(0, 4)), new TextDecoder().decode(step.slice(0, 12)),
            mesh.report, headers, turned.surface.up, distances.length, list.length > 3,
            (await client.formats()).formats[0].name, client.resolve('/v1/x'),
        ];"""
    assert ENGINE == 4
    glb, step, report, headers, up, count, is_long, name, url = evaluate(folder, code, server)
    assert (glb, step) == ("glTF", "ISO-10303-21")
    assert report["triangles"] == 4
    assert headers == ["4"]
    assert (up, count, is_long, name) == ("z", 1, True, "glb")
    assert url == f"{server}/v1/x"


def test_a_camera_does_not_go_into_an_address(folder: Path, server: str) -> None:
    code = """const camera = { position: [4, 3, 9], field_of_view: 0.8, height: 1080 };
        const client = new SurfaceClient(argument);
        const mesh = await client.mesh('saddle', { camera, pixel_tolerance: 8 });
        return mesh.report.triangles;"""
    assert evaluate(folder, code, server) > 0


# Errors


def test_a_refusal_has_the_fields_of_the_problem(folder: Path, server: str) -> None:
    code = """const client = new SurfaceClient(argument);
        const error = await client.mesh('saddle', { resolution: 0 }).catch((error) => error);
        return [error instanceof ServiceError, error.name, error.message, { ...error }];"""
    is_error, name, message, fields = evaluate(folder, code, server)
    problem = httpx.get(f"{server}/v1/surfaces/saddle/mesh.json?resolution=0").json()
    assert (is_error, name, message) == (True, "ServiceError", problem["detail"])
    expected = {key: problem[key] for key in ("status", "code", "title", "errors")}
    assert fields == expected | {"name": "ServiceError"}


NO_RESPONSE = """const client = new SurfaceClient(argument, { timeout: 200 });
    const error = await client.formats().catch((error) => error);
    return [error instanceof NoResponse, error.message];"""


def test_a_service_that_is_away_is_no_response(folder: Path, script: Script, scripted: str) -> None:
    assert evaluate(folder, NO_RESPONSE, "http://127.0.0.1:1")[0] is True
    script.answer(502, "Bad Gateway", Content_Type="text/plain")
    script.answer(200, "a page", Content_Type="text/html")
    assert evaluate(folder, NO_RESPONSE, scripted) == [
        True,
        "The service does not answer: 502 Bad Gateway",
    ]
    is_no_response, message = evaluate(folder, NO_RESPONSE, scripted)
    assert is_no_response
    assert message.startswith("This is not a surface service")


def test_a_call_ends_after_its_timeout_and_when_it_is_aborted(folder: Path) -> None:
    code = """let aborted = 0;
        const fetch = (url, { signal }) => new Promise((resolve, reject) => {
            signal.addEventListener('abort', () => { aborted += 1; reject(signal.reason); });
        });
        const client = new SurfaceClient('http://127.0.0.1', { fetch, timeout: 50 });
        const late = await client.formats().catch((error) => error);
        const controller = new AbortController();
        setTimeout(() => controller.abort(new Error('by hand')), 20);
        const ended = await client.formats({ signal: controller.signal }).catch((error) => error);
        const after = await client.formats({ signal: controller.signal }).catch((error) => error);
        return [late instanceof NoResponse, ended.message, after.message, aborted];"""
    assert evaluate(folder, code) == [True, "by hand", "by hand", 2]


# A busy service


def test_a_used_up_rate_is_waited_for(folder: Path) -> None:
    """The limit is that of a real service: one request a second, after the first ones."""
    with run_service(Settings(rate_limit=60)) as url:
        code = """const waits = [];
            while ((await fetch(`${argument}/v1/formats`)).ok);
            const onProgress = ({ kind, seconds, error }) => {
                waits.push([kind, seconds, error.status]);
            };
            const list = await new SurfaceClient(argument).surfaces({ onProgress });
            return [list.length > 0, waits[0], waits.length];"""
        is_there, wait, _ = evaluate(folder, code, url)
    assert is_there
    assert wait == ["retry", 1, 429]


def test_retries_end_at_the_deadline_and_where_they_do_not_help(
    folder: Path, script: Script, scripted: str
) -> None:
    code = """const client = new SurfaceClient(argument, { timeout: 3000, patience: Infinity });
        const error = await client.measure({}).catch((error) => error);
        return [error.status ?? null, error.code ?? null, error.retryAfter ?? null];"""
    script.answer(503, busy(), Retry_After="0")
    script.answer(429, busy("rate_limited", 429), Retry_After="0")
    script.answer(200, {})
    assert evaluate(folder, code, scripted) == [None, None, None]
    assert len(script.requests) == 3
    for problem, headers, expected in (
        (busy(), {"Retry_After": "4"}, [503, "busy", 4]),
        (busy(), {"Retry_After": "Fri, 01 Jan 2100 00:00:00 GMT"}, [503, "busy"]),
        (busy(), {}, [503, "busy", None]),
        (busy("out_of_time"), {"Retry_After": "0"}, [503, "out_of_time", 0]),
    ):
        del script.requests[:], script.responses[:]
        script.answer(503, problem, **headers)
        assert evaluate(folder, code, scripted)[: len(expected)] == expected
        # Work that takes long is asked for once more, as a job.
        assert len(script.requests) == (2 if problem["code"] == "out_of_time" else 1)


def test_a_wait_for_a_busy_service_can_be_aborted(
    folder: Path, script: Script, scripted: str
) -> None:
    script.answer(503, busy(), Retry_After="30")
    code = """const controller = new AbortController();
        const error = await new SurfaceClient(argument).formats({
            signal: controller.signal, onProgress: () => controller.abort(),
        }).catch((error) => error);
        return error.name;"""
    assert evaluate(folder, code, scripted) == "AbortError"


# Keys


def test_the_key_goes_to_the_service_and_to_no_other_host(
    folder: Path, script: Script, scripted: str
) -> None:
    script.answer(200, {})
    code = """const client = new SurfaceClient(argument, { key: 'secret' });
        await client.formats();
        await client.request(argument.replace('127.0.0.1', 'localhost') + '/v1/formats');
        const sent = [];
        const fetch = (url, { headers }) => {
            sent.push([url, headers.get('Authorization')]);
            return Promise.reject(new TypeError('no network'));
        };
        const key = () => 'secret';
        const other = new SurfaceClient('http://here.example/below', { key, fetch });
        await other.formats().catch(() => {});
        await other.request('//there.example/v1').catch(() => {});
        return sent;"""
    assert evaluate(folder, code, scripted) == [
        ["http://here.example/below/v1/formats", "Bearer secret"],
        ["http://there.example/v1", None],
    ]
    keys = [headers.get("authorization") for _, _, headers in script.requests]
    assert keys == ["Bearer secret", None]


def test_a_refused_key_is_asked_for(folder: Path) -> None:
    settings = Settings(api_keys=(format_entry("alice", KEY),))
    code = """let key = '';
        const refusals = [];
        const client = new SurfaceClient(argument.server, {
            key: () => key,
            onKeyRefused: async (error, sentKey) => {
                refusals.push([error.code, sentKey]);
                key = refusals.length === 1 ? argument.wrong : argument.key;
                return refusals.length < 3;
            },
        });
        const { triangles } = await client.estimate('saddle', { resolution: 1 });
        return [refusals, triangles];"""
    wrong = make_key()
    with run_service(settings) as server:
        argument = {"server": server, "key": KEY, "wrong": wrong}
        refusals, triangles = evaluate(folder, code, argument)
    assert refusals == [["key_needed", ""], ["key_unknown", wrong]]
    assert triangles == 2


# Jobs

JOB = {"id": "1", "links": {"self": "/v1/jobs/1", "events": "/e", "results": "/r"}}


def event(state: str) -> str:
    return f"data: {json.dumps(JOB | {'state': state})}\n\n"


def test_impatient_work_is_a_job_of_the_service(folder: Path, server: str) -> None:
    """With a patience of 0 every call becomes a job; its result is that of the call."""
    code = """const client = new SurfaceClient(argument.server, { patience: 0 });
        const states = [];
        const mesh = await client.mesh(argument.surface, { resolution: 5 }, {
            onProgress: ({ kind, job }) => states.push([kind, job.state]),
        });
        const error = await client.measure({ type: 'tube' }).catch((error) => error);
        return [mesh, states.at(-1), error.errors.map(({ pointer }) => pointer)];"""
    mesh, last, pointers = evaluate(folder, code, {"server": server, "surface": SADDLE})
    body = {"surface": SADDLE, "resolution": 5}
    assert mesh == httpx.post(f"{server}/v1/mesh", json=body).json()
    assert last == ["job", "succeeded"]
    assert pointers == ["/surface"] or all(each.startswith("/surface") for each in pointers)


def test_the_problem_of_a_part_is_that_of_the_call(
    folder: Path, script: Script, scripted: str
) -> None:
    """Events may end early, as when the service restarts."""
    problem = busy("result_too_large", 413)
    issue = {
        "code": "too_many_vertices",
        "detail": "Too many.",
        "pointer": "/parts/0/body/resolution",
    }
    script.answer(503, busy("out_of_time"))
    script.answer(202, JOB | {"state": "queued"}, Preference_Applied="respond-async")
    for text in (event("running")[:-9], event("running") + ": silence\n\n" + event("failed")):
        script.responses.append((200, {"Content-Type": "text/event-stream"}, text))
    script.answer(200, {"results": [{"part": 0, "problem": problem | {"errors": [issue]}}]})
    code = """const states = [];
        const onProgress = ({ job }) => states.push(job.state);
        const client = new SurfaceClient(argument);
        const error = await client.mesh({}, {}, { onProgress }).catch((error) => error);
        return [states, error.status, error.code, error.errors[0].pointer];"""
    assert evaluate(folder, code, scripted) == [
        ["queued", "running", "failed"],
        413,
        "result_too_large",
        "/resolution",
    ]
    assert [(method, path) for method, path, _ in script.requests] == [
        ("POST", "/v1/mesh"),
        ("POST", "/v1/mesh"),
        ("GET", "/e"),
        ("GET", "/e"),
        ("GET", "/r"),
    ]
    assert script.requests[1][2]["prefer"] == "respond-async"


def test_a_mesh_by_its_address_is_asked_for_again_where_there_are_no_jobs(folder: Path) -> None:
    """An impatient client asks for a job first. The reason of a refusal is that of the mesh."""
    code = """const answer = (body, status) => new Response(JSON.stringify(body), {
            status,
            headers: { 'Content-Type': `application/${status < 400 ? 'json' : 'problem+json'}` },
        });
        const run = async (first) => {
            const sent = [];
            const fetch = async (url, { method = 'GET', signal }) => {
                sent.push(`${method} ${new URL(url).pathname}`);
                if (method === 'POST') return answer({ status: 404, code: 'not_found' }, 404);
                return sent.length === 1 ? first(signal) : answer({ faces: [] }, 200);
            };
            const client = new SurfaceClient('http://127.0.0.1', { fetch, patience: 20 });
            const mesh = await client.mesh('saddle').catch((error) => error.code);
            return [mesh, sent];
        };
        const late = (signal) => new Promise((resolve, reject) => {
            signal.addEventListener('abort', () => reject(signal.reason));
        });
        const refuse = () => answer({ status: 503, code: 'out_of_time' }, 503);
        return [await run(late), await run(refuse)];"""
    mesh, job = "GET /v1/surfaces/saddle/mesh.json", "POST /v1/jobs"
    assert evaluate(folder, code) == [
        [{"faces": []}, [mesh, job, mesh]],
        ["out_of_time", [mesh, job]],
    ]


def test_an_aborted_call_withdraws_its_job(folder: Path, script: Script, scripted: str) -> None:
    script.answer(503, busy("out_of_time"))
    script.answer(202, JOB | {"state": "queued"}, Preference_Applied="respond-async")
    script.responses.append((200, {"Content-Type": "text/event-stream"}, event("running")))
    script.answer(200)
    code = """const controller = new AbortController();
        const error = await new SurfaceClient(argument).mesh({}, {}, {
            signal: controller.signal,
            onProgress: ({ job }) => { if (job.state === 'running') controller.abort(); },
        }).catch((error) => error);
        return error.name;"""
    assert evaluate(folder, code, scripted) == "AbortError"
    assert script.requests[-1][:2] == ("DELETE", "/v1/jobs/1")


# The queue and the geometry


def test_the_queue_sends_only_the_newest(folder: Path) -> None:
    """With `keep` a running request ends, without it is aborted; errors of old ones are dropped."""
    code = """const log = [];
        const send = (item, signal) => new Promise((resolve, reject) => {
            log.push(item);
            signal.addEventListener('abort', () => reject(signal.reason));
            setTimeout(() => (item < 0 ? reject(new Error('refused')) : resolve(item)), 10);
        });
        const runAll = (queue, items) => (
            Promise.all(items.map((item) => queue.run(item).catch(String))));
        const none = (results) => results.map((result) => result ?? 'none');
        const busy = [];
        const kept = new NewestOnly(send, { onBusy: (now) => busy.push(now && now.item) });
        const results = [none(await runAll(kept, [1, 2, 3])), none(await runAll(kept, [-1, -2]))];
        const asked = [];
        const keep = (item, milliseconds) => {
            asked.push([item, milliseconds < 1000]);
            return false;
        };
        const replaced = new NewestOnly(send, { keep });
        results.push(none(await runAll(replaced, [4, 5])));
        const ended = replaced.run(6);
        const waiting = replaced.run(7);
        replaced.abort();
        results.push(none([await ended, await waiting]), [replaced.isBusy, kept.isBusy]);
        results.push([await replaced.run(8)]);
        const runs = kept.run(11);
        const waits = kept.run(12);
        kept.drop();
        results.push(none([await runs, await waits]));
        return [results, log, busy.slice(0, 6), asked[0]];"""
    results, log, busy_items, asked = evaluate(folder, code)
    assert results == [
        [1, "none", 3],
        ["none", "Error: refused"],
        ["none", 5],
        ["none", "none"],
        [False, False],
        [8],
        [11, "none"],
    ]
    assert log == [1, 3, -1, -2, 4, 5, 6, 8, 11]
    assert asked == [4, True]
    assert busy_items == [1, 3, None, -1, -2, None]


GEOMETRY = """const THREE = await import(argument.three);
    const client = new SurfaceClient(argument.server);
    const describe = async (surface, options) => {
        const mesh = await client.mesh(surface, options);
        const geometry = toBufferGeometry(THREE, mesh);
        const list = ({ array }) => Array.from(array);
        return {
            mesh,
            index: list(geometry.index),
            kind: geometry.index.array.constructor.name,
            attributes: Object.fromEntries(Object.entries(geometry.attributes)
                .map(([name, attribute]) => [name, [attribute.itemSize, list(attribute)]])),
            groups: geometry.groups,
            isGeometry: geometry instanceof THREE.BufferGeometry,
        };
    };
    return Promise.all(argument.requests.map((request) => describe(...request)));"""


def find_three(folder: Path) -> str:
    return (folder / "node_modules" / "three" / "build" / "three.module.js").as_uri()


def make_geometries(folder: Path, server: str, *requests: list[Any]) -> list[dict[str, Any]]:
    argument = {"three": find_three(folder), "server": server, "requests": requests}
    geometries: list[dict[str, Any]] = evaluate(folder, GEOMETRY, argument)
    return geometries


def test_geometries_have_the_numbers_of_the_mesh(folder: Path, server: str) -> None:
    """Each corner has its position and its normal, at creases and in quads, too."""
    geometries = make_geometries(
        folder,
        server,
        ["utah-teapot", {"resolution": 2}],
        ["cone", {"resolution": 3}],
        ["rounded-box", {"resolution": 3}],
        ["trefoil-tube", {"resolution": 3}],
        ["torus", {"resolution": 2, "faces": "quads"}],
    )
    for geometry in geometries:
        mesh = geometry["mesh"]
        assert geometry["isGeometry"]
        assert geometry["kind"] == "Uint16Array"
        corners = mesh.get("attribute_faces", mesh["faces"])
        faces = [triangle for face in corners for triangle in split(face)]
        assert geometry["index"] == [corner for face in faces for corner in face]
        size, positions = geometry["attributes"]["position"]
        assert (size, len(positions)) == (3, 3 * len(mesh["normals"]))
        for face, rows in zip(mesh["faces"], corners, strict=True):
            for vertex, row in zip(face, rows, strict=True):
                written = positions[3 * row : 3 * row + 3]
                assert written == pytest.approx(mesh["vertices"][vertex], abs=1e-6)
        normals = [x for row in mesh["normals"] for x in row]
        assert geometry["attributes"]["normal"][1] == pytest.approx(normals, abs=1e-6)
        ends = [(group["start"], group["start"] + group["count"]) for group in geometry["groups"]]
        starts = [sum(3 * (len(face) - 2) for face in corners[:k]) for k in range(len(corners) + 1)]
        assert ends == [tuple(starts[k] for k in part["faces"]) for part in mesh["parts"]]


def split(face: list[int]) -> list[list[int]]:
    return [face] if len(face) == 3 else [face[:3], [face[0], *face[2:]]]


def test_geometries_have_colours_attributes_and_long_indices(folder: Path, server: str) -> None:
    colored = SADDLE | {
        "colors": [[[1, 0.5, 0], [0, 0, 0]], [[0, 1, 0], [0.02, 0, 1]]],
        "attributes": {"Heat": [[[1.5], [2]], [[3], [4]]]},
    }
    (small,) = make_geometries(folder, server, [colored, {"resolution": 1, "uvs": True}])
    mesh, attributes = small["mesh"], small["attributes"]
    size, colors = attributes["color"]
    assert size == 3
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for row in mesh["colors"]
        for c in row
    ]
    assert colors == pytest.approx(linear, abs=1e-6)
    assert attributes["uv"] == [2, [x for row in mesh["uvs"] for x in row]]
    assert sorted(attributes["_heat"][1]) == [1.5, 2, 3, 4]
    # 65535 in 16 bits would begin a new strip of triangles.
    code = """const THREE = await import(argument.three);
        const faces = [[0, 1, argument.count - 1]];
        const vertices = Array(argument.count).fill([0, 0, 0]);
        const { index, attributes } = toBufferGeometry(THREE, { vertices, faces, parts: [] });
        return [index.array.constructor.name, index.getX(2), Object.keys(attributes)];"""
    for count, kind in ((0xFFFF, "Uint16Array"), (0x10000, "Uint32Array")):
        argument = {"three": find_three(folder), "count": count}
        assert evaluate(folder, code, argument) == [kind, count - 1, ["position"]]
