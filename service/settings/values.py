"""Every setting: its name, type, default, range and description.

`make generated` writes the table in `docs/settings.md` from these fields.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from service.decoders.format import FileLimits
from service.pipeline.limits import Limits
from service.schemas.document import DEFAULT_LIMITS, MAX_BYTES, MEMBERS_FACTOR, PARSED_DEPTH
from service.settings.listening import HOST, PORT
from service.settings.runtime import MIN_MEMORY, count_processors, half_of_memory
from service.settings.types import Bytes, Secrets, Texts
from service.surface.checks import MAX_DEGREE

JOB_PROCESS_MEMORY = 256 << 20
"""Bytes of the memory of requests for each job process: half of the memory of a
container of 512 MiB, which has room for one (some 100 MB, beside its batch)."""


class Settings(BaseModel):
    """All settings; without arguments, the defaults.

    Only `read_environment` reads the environment.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", hide_input_in_errors=True, allow_inf_nan=False
    )

    # Addresses
    host: str = Field(default=HOST, min_length=1, description="Address to listen at.")
    port: int = Field(
        default=PORT, ge=0, le=65535, description="Port to listen at; 0 means any free port."
    )
    workers: int = Field(
        default=1,
        ge=0,
        le=64,
        description="Processes that serve at this port (Linux). 0 means one for each processor, at "
        "most 4, and fewer if each would have less than 1 GiB of the memory of the machine or "
        "container. Each worker has threads, a queue, connections and a cache of its own, and "
        "counts rates by itself.",
    )
    metrics_port: int = Field(
        default=0,
        ge=0,
        le=65535,
        description="Each worker also serves at 127.0.0.1, at this port plus its number, from 0: "
        "there Prometheus finds its metrics. 0 means no such ports.",
    )
    trusted_proxies: Texts = Field(
        default=(),
        description="Addresses and networks of trusted proxies, such as `10.0.0.0/8`, or `unix` "
        "for connections to a Unix socket. The service believes their `X-Forwarded-For` (the "
        "client's address) and `X-Forwarded-Proto`.",
    )
    cors_origins: Texts = Field(
        default=("*",),
        description="Origins whose pages may read responses, such as `https://example.com`; `*` "
        "means all. An empty list switches CORS off.",
    )
    frame_ancestors: Texts = Field(
        default=(),
        description="Origins whose pages may show `/embed` in a frame, such as "
        "`https://example.com`. No other page of the service can be in a frame.",
    )

    # Sizes
    max_head_bytes: Bytes = Field(
        default=1 << 16,
        ge=1024,
        le=1 << 20,
        description="Bytes of a request's URL and headers together.",
    )
    max_body_bytes: Bytes = Field(
        default=64 << 20,
        ge=1024,
        le=1 << 32,
        description="Bytes of a request's body: of any file that is sent.",
    )
    max_control_points: int = Field(
        default=DEFAULT_LIMITS.max_control_points,
        ge=4,
        le=100_000_000,
        description="Control points of a surface, and triangles of a mesh that is judged.",
    )
    max_degree: int = Field(
        default=DEFAULT_LIMITS.max_degree,
        ge=1,
        le=MAX_DEGREE,
        description="Degree of a patch, a curve or a spline.",
    )
    max_json_bytes: Bytes = Field(
        default=MAX_BYTES,
        ge=1024,
        le=1 << 32,
        description="Bytes of a JSON body; `SURFACE_MAX_BODY_BYTES` applies too. Larger nets can "
        "be sent as `.npy`.",
    )
    max_json_values: int = Field(
        default=DEFAULT_LIMITS.max_values,
        ge=1000,
        le=1 << 32,
        description="Commas and opening brackets of a JSON body; a control point takes 4. Each "
        "object, such as a curve, allows 32 more.",
    )
    max_json_depth: int = Field(
        default=DEFAULT_LIMITS.max_depth,
        ge=16,
        le=PARSED_DEPTH,
        description="Depth of nested brackets in a document.",
    )
    max_patches: int = Field(
        default=1_000_000, ge=1, le=100_000_000, description="Bézier patches of a surface."
    )
    max_faces: int = Field(
        default=DEFAULT_LIMITS.max_faces,
        ge=1,
        le=10_000_000,
        description="Faces of all breps of a surface.",
    )
    max_members: int = Field(
        default=DEFAULT_LIMITS.max_members,
        ge=1,
        le=1_000_000,
        description="Surfaces of a group: those of members, and those among its definitions. A "
        f"group may have {MEMBERS_FACTOR} times as many members.",
    )
    max_placed_faces: int = Field(
        default=FileLimits().max_placed_faces,
        ge=1,
        le=100_000_000,
        description="Faces of a surface with those of a part counted once for each placement.",
    )
    max_file_entities: int = Field(
        default=FileLimits().max_entities,
        ge=100,
        le=100_000_000,
        description="Entities of a CAD file: its records or objects, of any kind.",
    )
    max_vertices: int = Field(
        default=Limits().max_vertices, ge=4, le=1 << 32, description="Vertices of a mesh."
    )
    max_points: int = Field(
        default=Limits().max_points,
        ge=1,
        le=1 << 32,
        description="Points of a query, or of a curve.",
    )
    max_response_bytes: Bytes = Field(
        default=Limits().max_bytes, ge=1024, le=1 << 32, description="Bytes of a response."
    )
    memory_bytes: Bytes = Field(
        default_factory=half_of_memory,
        ge=MIN_MEMORY,
        le=1 << 45,
        description="Memory for all requests together: bodies, surfaces, meshes, responses not "
        "yet sent, and the cache. A request that would need more is refused before any work. The "
        "process itself takes some 120 MB more, one that waits for the next CAD file 40 MB, and "
        "plans of meshes and prepared parts together up to 1/16 of this value, but at most 512 "
        "MiB. The default is half of the memory of the machine or container. Each of several "
        "workers has an equal part of this value, less 75 MB.",
    )
    cache_bytes: Bytes = Field(
        default=128 << 20,
        ge=0,
        le=1 << 40,
        description="Memory of the cache of encoded responses, while requests do not need it; "
        "0 switches the cache off. Only cached responses and the files of the pages are "
        "compressed.",
    )

    # Counts, and times in seconds
    threads: int = Field(
        default=0,
        ge=0,
        le=1024,
        description="Threads that compute surfaces, in each worker; 0 means that the workers share "
        "the processors, one for each thread.",
    )
    max_queue: int = Field(
        default=64,
        ge=0,
        le=100_000,
        description="Requests that may wait for a thread or for memory; the service refuses more.",
    )
    max_connections: int = Field(
        default=2048, ge=1, le=1_000_000, description="Open connections at the same time."
    )
    head_timeout: float = Field(
        default=10, gt=0, le=3600, description="Time for a request's head to arrive."
    )
    body_timeout: float = Field(
        default=60, gt=0, le=3600, description="Time for a request's body to arrive."
    )
    request_timeout: float = Field(
        default=60,
        gt=0,
        le=3600,
        description="Time to wait and compute, after the body has arrived.",
    )
    send_timeout: float = Field(
        default=30,
        gt=0,
        le=3600,
        description="Time for a client to receive each MiB of a response.",
    )
    keep_alive: float = Field(
        default=75,
        gt=0,
        le=3600,
        description="Time for which a connection may be idle; set a longer time than the proxy "
        "has for this.",
    )
    drain_delay: float = Field(
        default=0,
        ge=0,
        le=600,
        description="Time after SIGTERM for which the service still serves requests while "
        "`/health/ready` returns 503: as long as the load balancer needs to notice.",
    )
    drain_timeout: float = Field(
        default=25,
        ge=0,
        le=3600,
        description="Time for running requests to end, after `SURFACE_DRAIN_DELAY`.",
    )

    # Storage
    # `read_environment` replaces this default by the user's data folder, which the description
    # names. Settings made without the environment, as in tests, store nothing on the disk.
    store: str = Field(
        default="memory://",
        min_length=1,
        description="Where surfaces are stored: a folder, `memory://`, or a bucket, `s3://…`. "
        "The default is the user's data folder.",
    )
    store_create: bool = Field(
        default=True,
        description="Whether to make a new store at the start if the folder of `SURFACE_STORE` is "
        "empty or missing. If false, the service then refuses to start: set this once the store "
        "exists, so that a disk that is not mounted is not taken for a new store.",
    )
    store_quota: Bytes = Field(
        default=10 << 30,
        ge=0,
        le=1 << 50,
        description="Bytes of all stored surfaces together; 0 means no limit.",
    )
    allow_delete: bool = Field(
        default=False, description="Whether clients may delete stored surfaces over HTTP."
    )

    # Jobs
    jobs: bool = Field(default=True, description="Whether clients may ask for jobs (`/v1/jobs`).")
    job_processes: int = Field(
        default=0,
        ge=0,
        le=1024,
        description="Processes that compute the parts of jobs; 0 means one for each processor, and "
        "one for each 256 MiB of `SURFACE_MEMORY_BYTES` at most. Workers share them: a job runs in "
        "those of the worker that has accepted it.",
    )
    job_lifetime: float = Field(
        default=7 * 86400,
        gt=0,
        le=366 * 86400,
        description="Time for which the results of a job are kept after its end.",
    )
    job_quota: Bytes = Field(
        default=10 << 30,
        ge=0,
        le=1 << 50,
        description="Bytes of all jobs, their files and their results together; 0 means no limit.",
    )
    job_part_timeout: float = Field(
        default=3600, gt=0, le=86400, description="Time to compute one part of a job."
    )
    max_jobs: int = Field(
        default=100,
        ge=1,
        le=100_000,
        description="Jobs of one key or address that have not ended.",
    )
    max_job_parts: int = Field(default=100_000, ge=1, le=10_000_000, description="Parts of a job.")
    max_job_bytes: Bytes = Field(
        default=1 << 30,
        ge=1024,
        le=1 << 40,
        description="Bytes of a body with one part a line (`application/x-ndjson`); "
        "`SURFACE_MAX_JSON_BYTES` applies to each line.",
    )

    dask: str = Field(
        default="",
        description="Address of a Dask scheduler, `tls://host:port`, whose workers compute the "
        "parts of jobs, in place of processes of this machine. Dask's own settings name the "
        "certificates. Needs the extra `cluster`, and a store that all workers reach.",
    )

    # Access
    api_keys: Texts = Field(
        default=(),
        description="API keys, as `surface key` prints them: `name:hash` or `name:hash:scopes`. To "
        "compute and to store, clients then need a key. Without keys, here or in a file, every "
        "client may do both.",
    )
    api_keys_file: str = Field(
        default="",
        description="A file with one API key a line. The service reads it again when it changes.",
    )
    public_reads: bool = Field(
        default=True,
        description="Whether clients may read stored surfaces and meshes by URL without a key "
        "or a signature.",
    )
    signing_keys: Secrets = Field(
        default=(),
        description="Secrets that sign URLs, each of 32 characters or more: the service signs with "
        "the first secret and accepts signatures of all. Without a secret, URLs cannot be signed.",
    )
    rate_limit: int = Field(
        default=0,
        ge=0,
        le=1_000_000,
        description="Requests a minute for each key or address, in each worker; 0 means no limit.",
    )
    compute_limit: int = Field(
        default=0,
        ge=0,
        le=1_000_000,
        description="Thread seconds a minute for each key or address, in each worker; 0 means no "
        "limit. While a caller has none left, its requests for work that is not cached are "
        "refused.",
    )

    # Observability
    metrics: Literal["open", "key", "off"] = Field(
        default="open",
        description="Whether `/metrics` is open, needs a key, or is switched off.",
    )
    log_format: Literal["text", "json"] = Field(default="text", description="Form of a log line.")
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="Least severe level that is logged."
    )
    access_log: bool = Field(default=True, description="Whether to log every request.")
    tracing: bool = Field(
        default=False,
        description="Whether to send OpenTelemetry a span for every request. The variables "
        "`OTEL_…` say where to send it. Needs the extra `telemetry`.",
    )

    @property
    def thread_count(self) -> int:
        """The setting `threads`; if it is 0, the number of processors."""
        return self.threads or count_processors()

    @property
    def job_process_count(self) -> int:
        """The setting `job_processes`; if it is 0, the number that processors and memory allow."""
        fitting = min(count_processors(), self.memory_bytes // JOB_PROCESS_MEMORY)
        return self.job_processes or max(1, fitting)
