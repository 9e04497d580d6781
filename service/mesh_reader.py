"""Reads mesh files in a child process with its own limits, which can be killed.

The library that reads files polls no deadline and bounds no memory. Children are forked from a server that has imported
what they need; it starts with the first file and ends with this process. Without it (Windows) each child starts fresh.
"""

from __future__ import annotations

import io
import multiprocessing
import os
import sys
import tempfile
import time
from concurrent import futures
from importlib.util import find_spec
from multiprocessing.connection import Connection, wait
from typing import Any, Final

import engine
from service.errors import ServiceError
from service.work import Call

_ROOM: Final = 2**28
_FOOTPRINT: Final = 16
"""Memory limit of a child besides what it starts with, and for each byte of a file."""
_POLL_SECONDS: Final = 0.05
_starter: Final = futures.ThreadPoolExecutor(1, thread_name_prefix="mesh reader")
_LONGEST: Final = 70
"""Length of the folder of temporary files up to which the server's socket has a name that systems take (104 bytes)."""


def context() -> Any:
    """Return the multiprocessing context; the first one of this process starts its server, which imports what readers
    need."""
    has_server = "forkserver" in multiprocessing.get_all_start_methods()
    has_server = has_server and len(os.fsencode(tempfile.gettempdir())) <= _LONGEST
    started: Any = multiprocessing.get_context("forkserver" if has_server else "spawn")
    if has_server:
        started.set_forkserver_preload(
            [f"{__package__}.mesh_reader", f"{__package__}.__main__", "trimesh.exchange.load"]
        )
    return started


def read(octets: bytes | bytearray | memoryview, kind: str | None, call: Call) -> Any:
    """Return the result of `engine.read_mesh`; `invalid_mesh` if the file cannot be read, in time or at all."""
    if kind == "glb" and find_spec("trimesh") is None:
        raise ServiceError("not_installed", f"this service reads no {kind} files; send .stl, .obj, .off or .ply")
    around = context()
    mine, theirs = around.Pipe(duplex=False)
    room = _ROOM + _FOOTPRINT * len(octets)
    child = around.Process(target=_child, args=(theirs, bytes(octets), kind, room, call.remaining()), daemon=True)
    starting = _starter.submit(child.start)  # the first waits for the server, which takes seconds
    try:
        while not futures.wait([starting], _POLL_SECONDS).done or not wait([mine], _POLL_SECONDS):
            call.remaining()
            if starting.done():
                starting.result()  # raises what kept the child from starting, which nothing would answer for
                theirs.close()  # so that the end of the child ends the pipe
        theirs.close()
        try:
            received = mine.recv()
        except EOFError:
            raise ServiceError(
                "invalid_mesh", f"the reader of {kind or 'mesh'} files ended without an answer"
            ) from None
    except engine.EngineError:  # a deadline is an OSError too (TimeoutError)
        raise
    except (OSError, EOFError) as error:  # EOFError: of the server that starts children
        raise ServiceError(
            "out_of_memory",
            f"the process that reads the file did not start or was lost ({error!s:.100}); try again later, or send the "
            "solid",
        ) from None
    finally:
        starting.add_done_callback(lambda _: _end(child, mine, theirs))
    if isinstance(received, str):
        raise ServiceError("invalid_mesh", received)
    call.take(4 * sum(array.nbytes for array in received))
    return received


def _end(child: Any, *pipe: Connection) -> None:
    """End a started child, done or not, and close both ends of its pipe."""
    for end in pipe:
        end.close()
    if child.pid is not None:
        child.kill()
        child.join()


def _child(answer: Connection, octets: bytes, kind: str | None, room: int, seconds: float) -> None:
    """Send the content of a file, or a sentence that says why it cannot be read."""
    _limit(room, seconds)
    try:
        answer.send(engine.read_mesh(io.BytesIO(octets), kind))
    except engine.EngineError as error:
        answer.send(error.message)
    except MemoryError:
        answer.send(f"to read it takes more than {room} bytes; simplify the mesh, or send it as vertices and faces")
    except Exception as error:  # a fault of ours; this process has no log
        answer.send(f"the file cannot be read: {type(error).__name__}")


def _limit(room: int, seconds: float) -> None:
    """Limit memory and time of this process, the time also if nobody kills it."""
    if sys.platform == "win32":
        return
    import resource

    limit = int(time.process_time() + seconds) + 2
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    if sys.platform == "linux":
        with open("/proc/self/statm") as file:
            now = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (now + room, now + room))
