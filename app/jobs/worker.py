"""What runs in a worker process. Imports nothing heavy: the number of threads must be set before NumPy is loaded."""

import importlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

Report = Callable[[float, str], None]
Compute = Callable[[Any, Report], Any]

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
REPORT_EVERY_S = 0.2

_progress: Any = None  # the queue to the server, set once per process


def initialise(progress: Any, warm_up: tuple[str, ...]) -> None:
    """Prepare a fresh process: one thread, deaf to Ctrl+C, ends with its parent, kernels loaded."""
    global _progress
    for name in THREAD_VARIABLES:
        os.environ[name] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, name="parent-watch", daemon=True).start()
    _progress = progress
    for name in warm_up:
        module, function = name.rsplit(".", 1)
        getattr(importlib.import_module(module), function)()


def _end_with_parent() -> None:
    """A pool's workers wait for ever when the server is killed; this ends them."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def ready() -> None:
    """Does nothing: makes the pool start its processes."""


def run(compute: Compute, ticket: tuple[str, int], args: Any) -> Any:
    """Compute in this process, sending progress as (ticket, fraction, message)."""
    return compute(args, throttled(lambda fraction, message: _progress.put((ticket, fraction, message))))


def throttled(report: Report) -> Report:
    """`report`, at most five times a second."""
    last = -REPORT_EVERY_S

    def maybe(fraction: float, message: str) -> None:
        nonlocal last
        if time.monotonic() - last >= REPORT_EVERY_S:
            last = time.monotonic()
            report(fraction, message)

    return maybe
