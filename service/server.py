"""uvicorn's server and its supervisor of worker processes, which end in time whatever is running."""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import Final

import uvicorn
from uvicorn.supervisors import Multiprocess

from service.settings import WARM_UP
from service.work import THREADS

log = logging.getLogger("service")

END_SECONDS: Final = 1.5
"""Time from the end of the drain until the process ends whatever still runs."""
HEALTH_SECONDS: Final = 60
"""Time that a worker process may be silent: on a busy machine the imports take many seconds."""


class Server(uvicorn.Server):
    """The server of one process."""

    def __init__(self, config: uvicorn.Config, clean: Callable[[], object]) -> None:
        super().__init__(config)
        self._clean = clean

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to end, and make sure that it does."""
        if not self.should_exit:
            _end_later(self.config, self._clean)
        super().handle_exit(sig, frame)


class Supervisor(Multiprocess):
    """The parent of worker processes: starts them, and restarts those that end by themselves."""

    def __init__(self, config: uvicorn.Config, sockets: list[socket.socket], clean: Callable[[], object]) -> None:
        super().__init__(config, sockets)
        self._clean = clean
        for sig in (signal.SIGTERM, signal.SIGINT):
            signal.signal(sig, self._end)

    def _end(self, *_: object) -> None:
        if self.should_exit.is_set():
            return
        self.should_exit.set()
        self._signal(signal.SIGTERM)  # at once: the loop below may be waiting for a worker that says nothing
        _end_later(self.config, self._kill)

    def _kill(self) -> None:
        self._signal(signal.SIGKILL)
        self._clean()

    def _signal(self, sig: int) -> None:
        for process in self.processes:
            with suppress(ProcessLookupError, TypeError):  # ended, or not started yet
                os.kill(process.pid, sig)  # type: ignore[arg-type]

    def keep_subprocess_alive(self) -> None:
        """Restart worker processes that have ended, and log it."""
        before = list(self.processes)
        super().keep_subprocess_alive()
        for old, new in zip(before, self.processes):
            if new is not old:
                log.warning(
                    "worker process %s ended by itself or said nothing for %d s (exit code %s); %s takes its place",
                    old.pid, HEALTH_SECONDS, old.exitcode, new.pid,
                )  # fmt: skip


def is_left_behind() -> bool:
    """Return whether a thread still runs that Python's exit would wait for, or abort within C++."""
    for _ in range(20):  # one that has nothing to do ends now
        if not any(thread.name.startswith((WARM_UP, THREADS)) for thread in threading.enumerate()):
            return False
        time.sleep(0.01)
    return True


def end_process() -> None:
    """Exit immediately with 0; threads that cannot be stopped are abandoned."""
    logging.shutdown()
    sys.stdout.flush()
    os._exit(0)


def _end_later(config: uvicorn.Config, last: Callable[[], object]) -> None:
    def end() -> None:
        time.sleep((config.timeout_graceful_shutdown or 0) + END_SECONDS)
        with suppress(Exception):
            last()
        end_process()

    threading.Thread(target=end, name="end", daemon=True).start()
