"""Settings from the environment and from the command line."""

import gc
import logging
import os
import platform
import re
from pathlib import Path
from typing import Any

import pytest
from platformdirs import user_data_path
from pydantic import SecretStr
from threadpoolctl import threadpool_info

from service.errors import InvalidSettings
from service.settings.environment import (
    apply_flags,
    describe_values,
    read_environment,
    summarize,
)
from service.settings.runtime import (
    collect_rarely,
    count_processors,
    half_of_memory,
    pin_blas,
)
from service.settings.values import Settings
from service.settings.workers import count_workers, share_settings
from tools.programs import run_python

TEXTS = {
    "host": "::1",
    "cors_origins": "https://a, https://b",
    "trusted_proxies": "10.0.0.0/8",
    "store": "./data",
    "store_create": "no",
    "allow_delete": "true",
    "jobs": "false",
    "public_reads": "0",
    "access_log": "False",
    "tracing": "1",
    "api_keys": "alice:00",
    "api_keys_file": "keys",
    "signing_keys": "0123456789abcdef0123456789abcdef",
    "metrics": "off",
    "log_format": "json",
    "log_level": "error",
    "max_degree": "5",
    "memory_bytes": "1 GB",
    "workers": "2",
}
"""Texts of settings that differ from the defaults. Of all other settings the text "1024", or for
seconds "99", is valid and differs."""


@pytest.fixture(autouse=True)
def _empty_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("SURFACE_")]:
        monkeypatch.delenv(name)


def read_settings(monkeypatch: pytest.MonkeyPatch, **variables: str) -> Settings:
    """The settings when these variables are set; `port="81"` sets SURFACE_PORT."""
    for name, text in variables.items():
        monkeypatch.setenv(f"SURFACE_{name.upper()}", text)
    return read_environment()


def test_an_empty_environment_gives_the_defaults() -> None:
    """Except for `store`: without the variable it is the data folder of the user."""
    settings = read_environment()
    assert settings.model_copy(update={"store": Settings().store}) == Settings()
    assert settings.thread_count >= 1  # `threads` is 0: one for each processor


def test_settings_read_the_environment_only_on_demand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("SURFACE_PORT", "81")
    assert Settings().port == 8000
    assert read_environment().port == 81


def test_surfaces_are_kept_in_the_data_folder_of_the_user_unless_another_store_is_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = user_data_path("surface-service", appauthor=False)
    assert folder.is_absolute()
    assert read_environment().store == str(folder)
    assert read_settings(monkeypatch, store="./data").store == "./data"


def test_switches_are_words_or_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    for text, value in (("1", True), ("true", True), ("False", False), ("0", False)):
        assert read_settings(monkeypatch, allow_delete=text).allow_delete is value


def test_sizes_may_have_a_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    for text, size in (("2048", 2048), ("64 MiB", 64 << 20), ("1.5GB", 1_500_000_000)):
        assert read_settings(monkeypatch, max_response_bytes=text).max_response_bytes == size


def test_every_setting_has_a_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = {name: TEXTS.get(name, "1024") for name in Settings.model_fields}
    texts |= {
        name: "99" for name, field in Settings.model_fields.items() if field.annotation is float
    }
    settings = read_settings(monkeypatch, **texts)
    unchanged = [name for name in texts if getattr(settings, name) == getattr(Settings(), name)]
    assert unchanged == []
    assert settings.cors_origins == ("https://a", "https://b")
    assert [key.get_secret_value() for key in settings.signing_keys] == [TEXTS["signing_keys"]]
    assert settings.max_body_bytes == settings.threads == settings.thread_count == 1024


def test_an_empty_list_of_origins_is_valid(monkeypatch: pytest.MonkeyPatch) -> None:
    assert read_settings(monkeypatch, cors_origins="").cors_origins == ()


@pytest.mark.parametrize(
    ("variable", "text", "message"),
    [
        # Kubernetes sets SURFACE_PORT to such a text for a Service with the name "surface".
        ("port", "tcp://10.0.0.1:80", "needed a whole number from 0 to 65535."),
        ("port", "65536", "got '65536', needed a whole number from 0 to 65535."),
        ("port", "", "got nothing"),
        ("host", "", "got nothing, needed a text, not empty."),
        ("threads", "-1", "needed a whole number from 0 to 1024."),
        ("max_degree", "65", "needed a whole number from 1 to 64."),
        ("max_body_bytes", "64 MiBs", "needed bytes, such as"),
        ("max_body_bytes", "nan", "needed bytes"),
        ("memory_bytes", "1KB", "got '1KB', needed bytes, such as 1048576 or 64MiB, from 16777216"),
        ("body_timeout", "0", "needed seconds above 0, to 3600."),
        ("body_timeout", "inf", "needed seconds above 0, to 3600."),
        ("store", "", "got nothing"),
        ("allow_delete", "2", "needed true or false."),
        ("metrics", "maybe", "needed one of open, key, off."),
    ],
)
def test_an_invalid_value_is_refused_with_the_name_of_its_variable(
    variable: str, text: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = f"SURFACE_{variable.upper()}"
    with pytest.raises(InvalidSettings, match=f"^{name}: .*{re.escape(message)}"):
        read_settings(monkeypatch, **{variable: text})


@pytest.mark.parametrize("name", [
    name for name, field in Settings.model_fields.items() if describe_values(field)[:5] == "bytes"
])  # fmt: skip
def test_every_setting_of_bytes_has_a_range(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bounds = re.search(r"from (\d+) to (\d+)$", describe_values(Settings.model_fields[name]))
    assert bounds is not None
    low, high = map(int, bounds.groups())
    for text in ({str(low - 1)} if low else set()) | {f"{high + 1}", "999 EB"}:
        with pytest.raises(
            InvalidSettings, match=f"^SURFACE_{name.upper()}: .*from {low} to {high}"
        ):
            read_settings(monkeypatch, **{name: text})
    for value in (low, high):
        assert getattr(read_settings(monkeypatch, **{name: str(value)}), name) == value


def test_the_error_names_all_invalid_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidSettings) as error:
        read_settings(monkeypatch, port="x", max_degree="y", tracing="z")
    variables = [line.partition(":")[0] for line in str(error.value).splitlines()]
    assert variables == ["SURFACE_PORT", "SURFACE_MAX_DEGREE", "SURFACE_TRACING"]


def test_flags_override_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = read_settings(monkeypatch, port="81", host="::1")
    assert apply_flags(settings, {"port": "82"}) == settings.model_copy(update={"port": 82})
    assert apply_flags(settings, {}) == settings


def test_the_summary_has_every_setting_in_one_line_and_no_secret() -> None:
    settings = Settings(
        api_keys=("alice:0123", "bob:4567"),
        signing_keys=(SecretStr("s" * 32),),
        store="s3://user:password@bucket/prefix",
        cors_origins=("https://a", "https://b"),
        max_body_bytes=1 << 20,
        allow_delete=True,
    )
    line = summarize(settings)
    assert line.isprintable()
    values = dict(pair.split("=", 1) for pair in line.split(" "))
    assert list(values) == [f"SURFACE_{name.upper()}" for name in Settings.model_fields]
    shown = ("API_KEYS", "SIGNING_KEYS", "STORE", "CORS_ORIGINS", "MAX_BODY_BYTES", "ALLOW_DELETE")
    assert [values[f"SURFACE_{name}"] for name in shown] == [
        *("(2)", "(1)", "s3://bucket/prefix", "https://a,https://b", "1048576", "true"),
    ]
    assert values["SURFACE_KEEP_ALIVE"] == "75"


def test_unknown_variable_is_reported(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    defaults = read_environment()
    with caplog.at_level(logging.WARNING):
        assert read_settings(monkeypatch, max_vertice="5") == defaults
    assert "SURFACE_MAX_VERTICE" in caplog.text


def test_the_key_of_a_client_is_not_reported_as_an_unknown_variable(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    defaults = read_environment()
    with caplog.at_level(logging.WARNING):
        assert read_settings(monkeypatch, key="sfk_0") == defaults
    assert caplog.text == ""


def test_defaults_are_valid_and_every_setting_is_described() -> None:
    for name, field in Settings.model_fields.items():
        assert Settings(**{name: field.default}) == Settings(), name
        assert field.description, name
        assert describe_values(field), name


def test_blas_is_pinned() -> None:
    pin_blas()
    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    assert pools
    assert {pool["num_threads"] for pool in pools} == {1}


MEASURE_TRIMMING = """
import resource
import numpy as np
from pathlib import Path
from service.settings.runtime import trim_heap, share_heap

share_heap()
def measure_resident():
    pages = Path("/proc/self/statm").read_text().split()[1]
    return int(pages) * resource.getpagesize()

bytes_before = measure_resident()
# Large blocks of 1 MiB (less than MMAP_BYTES, so on the heap) and small blocks of 8 KiB, by turns.
blocks = [np.ones(1 << (10 if k % 2 else 17)) for k in range(128)]
small_blocks = blocks[1::2]
del blocks
trim_heap()
print(measure_resident() - bytes_before)
"""
"""A program that prints how many bytes more are resident after large blocks are freed."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has these settings")
def test_freed_memory_returns_to_the_system() -> None:
    """The program frees 64 blocks of 1 MiB, with small blocks in use between them."""
    process = run_python("-c", MEASURE_TRIMMING)
    assert int(process.stdout) < 16 << 20


def test_garbage_is_collected_less_often_than_by_default() -> None:
    old_threshold = gc.get_threshold()
    try:
        gc.set_threshold(700, 10, 10)
        collect_rarely()
        assert gc.get_threshold()[0] > 700
        assert gc.isenabled()
    finally:
        gc.set_threshold(*old_threshold)


@pytest.mark.parametrize(
    ("group", "files"),
    [
        ("0::/a/b", {"a/memory.max": "536870912\n", "a/b/memory.max": "max\n"}),
        ("0::/of/the/host", {"memory.max": "536870912\n"}),
        ("5:cpu,memory:/a\n0::/", {"memory/a/memory.limit_in_bytes": "536870912\n"}),
    ],
    ids=["parent", "path-of-the-host", "version-1"],
)
def test_half_of_the_memory_of_the_control_group_is_used(
    group: str, files: dict[str, str], tmp_path: Path
) -> None:
    """The limit is that of the process's control group or of a parent of it.

    In a container the path of the group may be that of the host; the limit is then in the top
    folder.
    """
    write_control_group(tmp_path, group, files)
    assert half_of_memory(tmp_path) == 1 << 28
    # Without a control group it is half of the memory of the machine, which has more than 512 MiB.
    (tmp_path / "proc" / "self" / "cgroup").unlink()
    assert half_of_memory(tmp_path) > 1 << 28
    assert Settings().memory_bytes == half_of_memory()


@pytest.mark.parametrize(
    ("group", "files"),
    [
        ("0::/a/b", {"a/cpu.max": "250000 100000\n", "a/b/cpu.max": "max 100000\n"}),
        ("0::/of/the/host", {"cpu.max": "300000 100000\n"}),
        (
            "5:cpu,cpuacct:/a\n0::/",
            {"cpu/a/cpu.cfs_quota_us": "300000\n", "cpu/a/cpu.cfs_period_us": "100000\n"},
        ),
    ],
    ids=["parent", "path-of-the-host", "version-1"],
)
def test_processors_are_those_of_the_affinity_and_of_the_control_group(
    group: str, files: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)))
    write_control_group(tmp_path, group, files)
    assert count_processors(tmp_path) == 3  # part of a processor counts as one
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {5})
    assert count_processors(tmp_path) == 1


def test_a_control_group_without_a_quota_limits_no_processors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)))
    without_quota = {"b/cpu.max": "max 100000\n", "cpu/b/cpu.cfs_quota_us": "-1\n"}
    write_control_group(tmp_path, "0::/b\n1:cpu:/b", without_quota)
    assert count_processors(tmp_path) == 8


def write_control_group(root: Path, groups: str, files: dict[str, str]) -> None:
    """Writes the files by which a process finds the limits of its control groups."""
    process = root / "proc" / "self"
    process.mkdir(parents=True, exist_ok=True)
    (process / "cgroup").write_text(f"9:pids:/\n{groups}\n", encoding="ascii")
    for name, text in files.items():
        file = root / "sys" / "fs" / "cgroup" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="ascii")


@pytest.mark.parametrize(
    ("processors", "gibibytes", "store", "expected"),
    [
        (3, 64, "/data", 3),
        (16, 64, "/data", 4),
        (16, 2.5, "/data", 2),
        (16, 0.5, "/data", 1),
        (16, 64, "memory://", 1),
    ],
)
def test_automatic_workers_fit_the_machine(
    processors: int,
    gibibytes: float,
    store: str,
    expected: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("service.settings.workers.count_processors", lambda: processors)
    memory = int(gibibytes * 2**30) // 2
    assert count_workers(Settings(workers=0, memory_bytes=memory, store=store)) == expected


def test_automatic_workers_have_ports_for_their_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.settings.workers.count_processors", lambda: 4)
    settings = Settings(workers=0, memory_bytes=8 << 30, store="/data", metrics_port=65534)
    assert count_workers(settings) == 2


@pytest.mark.parametrize(
    ("settings", "needed"),
    [
        ({"store": "memory://"}, "1 with SURFACE_STORE=memory://"),
        ({"memory_bytes": 128 << 20}, "at most 1 with SURFACE_MEMORY_BYTES=134217728"),
        ({"metrics_port": 65534}, "fewer with SURFACE_METRICS_PORT=65534"),
    ],
)
def test_workers_that_cannot_run_are_refused(settings: dict[str, Any], needed: str) -> None:
    chosen: dict[str, Any] = {"workers": 3, "store": "/data", "memory_bytes": 1 << 30, **settings}
    with pytest.raises(
        InvalidSettings, match=f"SURFACE_WORKERS: got 3, needed {re.escape(needed)}"
    ):
        count_workers(Settings(**chosen))


def test_several_workers_need_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "win32")
    with pytest.raises(
        InvalidSettings, match="needed 1 on this system: several workers need Linux"
    ):
        count_workers(Settings(workers=2, store="/data"))
    assert count_workers(Settings(workers=1)) == 1
    assert count_workers(Settings(workers=0, store="/data")) == 1


def test_workers_share_the_memory_and_the_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("workers", "values"):
        monkeypatch.setattr(f"service.settings.{module}.count_processors", lambda: 5)
    machine = 4 << 30
    settings = Settings(memory_bytes=machine // 2, store="/data")
    assert share_settings(settings, 1) == settings
    part = share_settings(settings, 2)
    assert part.memory_bytes == (machine - 2 * 150_000_000) // 2 // 2
    assert part.threads == 2
    assert part.job_processes == max(1, settings.job_process_count // 2)
    assert share_settings(settings, 8).threads == 1
    assert share_settings(Settings(threads=3), 2).threads == 3  # as the operator chose
