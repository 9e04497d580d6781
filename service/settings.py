"""Every limit of the service, from the environment, each with its reason.

A name is set as an environment variable with the prefix ``GEOMETRY_``, for example ``GEOMETRY_MAX_POINTS=50000``, or as
a flag: ``--max-points 50000`` (__main__.py). Sizes take units: ``64MiB``.
Limits on counts stand in the OpenAPI document too (openapi.py puts them there by name).
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, ByteSize, Field, SecretStr, TypeAdapter, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from engine import default_workers

WARM_UP: Final = "warm-up"
"""The name of the thread that compiles."""
_SIZE: Final = TypeAdapter(ByteSize)


def _bytes(value: object) -> object:
    return int(_SIZE.validate_python(value)) if isinstance(value, str) else value


Count = Annotated[int, Field(ge=1)]
Size = Annotated[int, BeforeValidator(_bytes), Field(ge=1)]


def _lower(value: object) -> object:
    return value.lower() if isinstance(value, str) else value


Seconds = Annotated[float, Field(gt=0)]


_FEWEST_CORES: Final = 4
_PROCESS_BYTES: Final = 2 * 2**30
"""Cores from which on more than one process starts by default, and memory of each: the sum of its limits."""


def _processes(root: Path = Path("/sys/fs/cgroup")) -> int:
    """Return a process a core where there are several and memory for each, else one."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 0
    for limit in (root / "memory.max", root / "memory" / "memory.limit_in_bytes"):
        with suppress(OSError, ValueError):  # there is none, or it is "max"
            memory = min(memory, int(limit.read_text()))
    n = min(default_workers(), memory // _PROCESS_BYTES)
    return n if n >= _FEWEST_CORES else 1


class Settings(BaseSettings):
    """Limits and addresses; the defaults serve one machine with a few GB of memory."""

    model_config = SettingsConfigDict(
        env_prefix="GEOMETRY_", frozen=True, extra="forbid", use_attribute_docstrings=True
    )

    host: str = "127.0.0.1"
    """Address to listen on. Loopback: nobody else's machine calls a service that its owner did not open on purpose."""
    port: Annotated[int, Field(ge=0, le=65535)] = 8000
    """Port to listen on; 0 takes a free port (it is printed)."""
    workers: Count = Field(default_factory=_processes)
    """Processes; by default one a core from 4 cores on, with 2 GiB of memory for each, else one. A process reads and
    writes JSON on one core at a time. Each has a memory of its own; without a store folder they share a temporary
    one."""
    log_level: Annotated[Literal["debug", "info", "warning", "error"], BeforeValidator(_lower)] = "info"
    """What is logged: debug, info, warning or error."""
    access_log: bool = True
    """A line for each request."""
    api_keys: Annotated[tuple[SecretStr, ...], NoDecode] = ()
    """Keys that requests must show one of, separated by commas; none by default: then anyone may call."""
    cors_origins: Annotated[tuple[str, ...], NoDecode] = ()
    """Origins that browsers may call from, separated by commas; none by default."""
    root_path: Annotated[str, Field(pattern=r"^(/[^/?#]+)*$")] = ""
    """Where a proxy shows the service, /geometry for example; requests may come with or without it."""
    trusted_proxies: str = "127.0.0.1"
    """Addresses and networks, separated by commas, whose X-Forwarded-For and -Proto are believed; * for all."""

    max_body_bytes: Size = 64 * 2**20
    """JSON takes about 60 bytes a 3D point: this is a million points, or a mesh of half a million faces."""
    max_points: Count = 2_000_000
    """Points, vertices or segments in one list; decoding holds about 200 bytes for each."""
    max_faces: Count = 4_000_000
    """Faces of one polyhedron or surface: a closed triangle mesh has twice as many as vertices."""
    max_planes: Count = 10_000
    """Rows of one convex solid: each point is compared with each row."""
    max_rings: Count = 100_000
    """Rings of one polygon."""
    max_terms: Count = 1_000
    """Terms of one polynomial, the engine's own limit."""
    max_operands: Count = 1_000
    """Operands of one CSG node."""
    max_csg_depth: Annotated[int, Field(ge=1, le=64)] = 32
    """Levels of a CSG tree; JSON itself is refused beyond 200 levels, and a CSG level takes two to three of them."""
    max_csg_nodes: Count = 1_000
    """Solids of one CSG tree, leaves and nodes together: each point visits each of them."""
    max_bodies: Count = 10_000
    """Bodies of one scene."""
    max_pairs: Count = 1_000_000
    """Pairs named in `skip` or `only`."""
    max_poses: Count = 100_000
    """Poses of one collision request."""
    max_polygons: Count = 100_000
    """Polygons of one clipping request."""
    max_answer_bytes: Size = 256 * 2**20
    """An answer before it is compressed; beyond it the request is refused, with what to ask for instead."""

    deadline_seconds: Seconds = 30.0
    """Time from the last byte of the request to the answer; common proxies give up after 60 s."""
    header_seconds: Seconds = 10.0
    """Time for the headers of a request to arrive, from the connection or their first byte."""
    write_seconds: Seconds = 10.0
    """Time for a client to read the next some 200 kB of an answer; one that does not is dropped."""
    answer_seconds: Seconds = 300.0
    """Time for a client to read a whole answer, however steadily it reads: meanwhile the answer holds its memory."""
    body_seconds: Seconds = 60.0
    """Time for a body to arrive: a slow sender must not hold its memory for ever."""
    drain_seconds: Seconds = 30.0
    """Time for running requests after SIGTERM; the process ends 2 s later whatever runs. Kubernetes kills 30 s after
    SIGTERM by default, so lower it there."""
    concurrency: Count = Field(default_factory=lambda: 4 * default_workers())
    """Requests computed at once. More than cores: long calls run in chunks of 2-20 ms, so short ones slip between."""
    queue_length: Count = 64
    """Requests that may wait for their turn; beyond it the answer is 503 with Retry-After."""
    inline_bytes: Annotated[int, BeforeValidator(_bytes), Field(ge=0)] = 2048
    """Bodies up to this size on simple solids are answered without a thread: a hand-over costs as much as the work."""
    request_bytes: Size = 2**30
    """Memory for requests under way, from body to answer: 503 where others hold it, 422 where one wants more alone."""
    store_bytes: Size = 512 * 2**20
    """Memory for stored solids; the least recently used leave first."""
    store_folder: Path | None = None
    """Folder for stored solids, kept over a restart and shared by all that are given it; none by default."""
    store_folder_bytes: Size = 10 * 2**30
    """Size of that folder; the files used longest ago leave first."""

    @field_validator("cors_origins", "api_keys", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(item.strip() for item in value.split(",") if item.strip())
        return value

    @classmethod
    def settings_customise_sources(cls, settings_cls, init_settings, env_settings, *_, **__):  # type: ignore[no-untyped-def]
        """Arguments, then the environment; no files."""
        return init_settings, env_settings
