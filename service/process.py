"""What only `python -m service` does to its process; within somebody else's, nothing here is called.

Worker processes are started by `create_app` below too, since they share nothing with the process that starts them.
"""

from __future__ import annotations

import gc
import logging
import sys
from typing import TYPE_CHECKING, Final

from service.memory import configure_malloc

if TYPE_CHECKING:
    from fastapi import FastAPI

SWITCH_SECONDS: Final = 0.0002
"""How long one thread keeps the interpreter while others wait: the event loop hands over several times a request, and
with Python's 5 ms each time beside a batch, small requests would wait for tens of milliseconds."""
_NEVER: Final = 2**31 - 1
"""Collections of younger objects until the oldest are looked at."""


def create_app() -> FastAPI:
    """Return the service for a process that is all its own."""
    from service.app import create_app

    gc.enable()  # all is imported (__main__.py)
    configure_malloc()
    sys.setswitchinterval(SWITCH_SECONDS)
    # what the lines leave out need not be looked up for each of them: it takes as long as writing the line
    logging.logThreads = logging.logProcesses = logging.logMultiprocessing = False
    return create_app(owns_process=True)


def freeze() -> None:
    """Have no later collection walk through what lives long; memory.py collects when there is little else."""
    if not gc.get_freeze_count():
        gc.freeze()  # half a million objects of modules and compiler
    gc.set_threshold(*gc.get_threshold()[:2], _NEVER)
