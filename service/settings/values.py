"""What an operator may choose, and within which bounds.

`docs/settings.md` lists it for operators; a test compares it with what stands here.
"""

import os
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, BeforeValidator, ByteSize, ConfigDict, Field, SecretStr
from pydantic_settings import NoDecode

from service.pipeline.limits import Limits
from service.schemas.document import DEFAULT_LIMITS, MAX_BYTES, PARSED_DEPTH, DocumentLimits
from service.settings.listening import HOST, PORT
from service.settings.process import LEAST, half_of_memory
from service.surface.checks import MAX_DEGREE

WORKING = 11 / 16
"""Of the memory, what one request may take beside its body: there is room for other bodies."""


def _parts(value: object) -> object:
    """The parts of a comma-separated list."""
    if not isinstance(value, str):
        return value
    return tuple(part.strip() for part in value.split(",") if part.strip())


Bytes: TypeAlias = Annotated[int, ByteSize]
Texts: TypeAlias = Annotated[tuple[str, ...], NoDecode, BeforeValidator(_parts)]
Secrets: TypeAlias = Annotated[tuple[SecretStr, ...], NoDecode, BeforeValidator(_parts)]


class Settings(BaseModel):
    """What an operator may choose; as it stands here, the defaults.

    Only `from_environment` reads the environment.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", hide_input_in_errors=True, allow_inf_nan=False
    )

    # Where
    host: str = Field(default=HOST, min_length=1, description="Address to listen at.")
    port: int = Field(default=PORT, ge=0, le=65535, description="Port to listen at; 0 takes any.")
    trusted_proxies: Texts = Field(
        default=(),
        description="Addresses and networks of proxies in front, `10.0.0.0/8` say, or `unix` for "
        "who connects to a Unix socket: what these say in `X-Forwarded-For` of who asks, and in "
        "`X-Forwarded-Proto`, is believed.",
    )
    cors_origins: Texts = Field(
        default=("*",), description="Origins whose pages may read answers; none switches CORS off."
    )

    # How large
    max_head_bytes: Bytes = Field(
        default=1 << 16,
        ge=1024,
        le=1 << 20,
        description="Bytes of the address and all headers of a request together.",
    )
    max_body_bytes: Bytes = Field(
        default=64 << 20, ge=1024, le=1 << 32, description="Bytes of a request's body."
    )
    max_control_points: int = Field(
        default=DEFAULT_LIMITS.max_control_points,
        ge=4,
        le=100_000_000,
        description="Control points of a surface.",
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
        description="Bytes of a JSON body, if `SURFACE_MAX_BODY_BYTES` is not less. Larger nets "
        "come as `.npy`.",
    )
    max_json_values: int = Field(
        default=DEFAULT_LIMITS.max_values,
        ge=1000,
        le=1 << 32,
        description="Commas and opening brackets of a JSON body; a control point takes four.",
    )
    max_json_depth: int = Field(
        default=DEFAULT_LIMITS.max_depth,
        ge=16,
        le=PARSED_DEPTH,
        description="Brackets that may be open at once in a document.",
    )
    max_patches: int = Field(
        default=1_000_000, ge=1, le=100_000_000, description="Bézier patches of a surface."
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
        default=Limits().max_bytes, ge=1024, le=1 << 32, description="Bytes of an answer."
    )
    memory_bytes: Bytes = Field(
        default_factory=half_of_memory,
        ge=LEAST,
        le=1 << 45,
        description="Memory for all that is under way together: bodies, surfaces, meshes, answers "
        "not yet sent, and what is kept of answers. What would take more is refused beforehand. "
        "The process itself takes some 120 MB beside it, and what is planned for meshes at most "
        "1/16 of it or 256 MB. Left out, it is half of what the machine, "
        "or the container, has.",
    )
    cache_bytes: Bytes = Field(
        default=128 << 20,
        ge=0,
        le=1 << 40,
        description="Encoded answers that are kept in memory, to be sent again, as long as nothing "
        "else needs the room; 0 keeps none. What is not kept is not compressed, either.",
    )

    # How many, and how long
    threads: int = Field(
        default=0,
        ge=0,
        le=1024,
        description="Surfaces computed at the same time; 0 takes the number of processors.",
    )
    max_queue: int = Field(
        default=64,
        ge=0,
        le=100_000,
        description="Requests that may wait for a thread or for memory; more are refused.",
    )
    max_connections: int = Field(
        default=2048, ge=1, le=1_000_000, description="Connections at the same time."
    )
    head_timeout: float = Field(
        default=10, gt=0, le=3600, description="Time for the head of a request to arrive."
    )
    body_timeout: float = Field(
        default=60, gt=0, le=3600, description="Time for the body of a request to arrive."
    )
    request_timeout: float = Field(
        default=60,
        gt=0,
        le=3600,
        description="Time for waiting and computing, once the body is there.",
    )
    send_timeout: float = Field(
        default=30,
        gt=0,
        le=3600,
        description="Time for a client to take an answer, for each MiB of it.",
    )
    keep_alive: float = Field(
        default=75,
        gt=0,
        le=3600,
        description="Time that a connection may be idle; longer than a proxy's in front of it.",
    )
    drain_delay: float = Field(
        default=0,
        ge=0,
        le=600,
        description="Time after SIGTERM during which all is answered but `/health/ready`: as long "
        "as whatever is in front takes to notice.",
    )
    drain_timeout: float = Field(
        default=25, ge=0, le=3600, description="Time for what is under way to end, after that."
    )

    # Where surfaces are kept
    store: str = Field(
        default="memory://",
        min_length=1,
        description="Where surfaces are kept: a folder, `memory://`, or a bucket, `s3://…`. "
        "Left out, it is the user's data folder.",
    )
    store_quota: Bytes = Field(
        default=10 << 30,
        ge=0,
        le=1 << 50,
        description="Bytes of all stored surfaces together; 0 sets no limit.",
    )
    allow_delete: bool = Field(
        default=False, description="Whether stored surfaces may be deleted over HTTP."
    )

    # Who may do what
    api_keys: Texts = Field(
        default=(),
        description="Keys that computing and storing need, as `surface key` prints them: "
        "`name:hash`. With none, and no file of them, everybody may.",
    )
    api_keys_file: str = Field(
        default="", description="A file with one such key a line. It is read again when it changes."
    )
    public_reads: bool = Field(
        default=True,
        description="Whether what is read by an address (surfaces, meshes by URL) needs neither "
        "a key nor a signature.",
    )
    signing_keys: Secrets = Field(
        default=(),
        description="Secrets that addresses are signed with, of 32 letters or more: the first "
        "signs, all are believed. None switches signed addresses off.",
    )
    rate_limit: int = Field(
        default=0,
        ge=0,
        le=1_000_000,
        description="Requests a minute of one key, or of one address; 0 sets no limit.",
    )

    # What is seen of it
    metrics: Literal["open", "key", "off"] = Field(
        default="open", description="Whether `/metrics` is open, needs a key, or is none."
    )
    log_format: Literal["text", "json"] = Field(default="text", description="What a log line is.")
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="The least that is logged."
    )
    access_log: bool = Field(default=True, description="Whether every request is logged.")
    tracing: bool = Field(
        default=False,
        description="Whether OpenTelemetry has a span of every request; its own variables, "
        "`OTEL_…`, say where to. Needs the extra `telemetry`.",
    )

    @property
    def workers(self) -> int:
        """Number of threads, with 0 resolved."""
        return self.threads or os.cpu_count() or 1


def document_limits(settings: Settings) -> DocumentLimits:
    """The settings that the language of requests needs."""
    return DocumentLimits(
        settings.max_control_points,
        settings.max_degree,
        settings.max_json_depth,
        settings.max_json_values,
    )


def result_limits(settings: Settings) -> Limits:
    """The settings that the pipeline needs."""
    return Limits(
        settings.max_vertices,
        settings.max_response_bytes,
        settings.max_points,
        max_patches=settings.max_patches,
        max_memory=int(settings.memory_bytes * WORKING),
    )
