"""Where computations run: worker processes, or the calling thread for tests. Both are `concurrent.futures` executors."""

import multiprocessing
import os
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Protocol

from app.jobs import worker
from app.jobs.worker import Compute

Ticket = tuple[str, int]  # job id and attempt
Progress = Callable[[Ticket, float, str], None]

__all__ = ["BrokenProcessPool", "Compute", "Inline", "Processes", "Runner", "Ticket", "runner_for"]


class Runner(Protocol):
    """An executor with progress."""

    slots: int

    def submit(self, compute: Compute, ticket: Ticket, args: Any) -> "Future[Any]": ...
    def rebuild(self) -> None: ...
    def close(self) -> None: ...


def runner_for(name: str, progress: Progress, warm_up: tuple[str, ...]) -> Runner:
    """The runner that the settings name."""
    if name == "inline":
        return Inline(progress)
    if name == "processes":
        return Processes(progress, warm_up)
    raise ValueError(f"Unknown executor {name!r}; known are 'processes' and 'inline'.")


class Inline:
    """Computes at once, on the calling thread."""

    slots = 1

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def submit(self, compute: Compute, ticket: Ticket, args: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        report = worker.throttled(lambda fraction, message: self._progress(ticket, fraction, message))
        try:
            future.set_result(compute(args, report))
        except Exception as error:  # noqa: BLE001 - the worker loop: the dispatcher looks at it
            future.set_exception(error)
        return future

    def rebuild(self) -> None:
        """There is nothing that could break."""

    def close(self) -> None:
        """There is nothing to end."""


class Processes:
    """A pool of spawned processes, one less than the machine has cores; never forked, because the server has threads."""

    def __init__(self, progress: Progress, warm_up: tuple[str, ...]) -> None:
        self.slots = max(1, (os.cpu_count() or 2) - 1)
        self._progress = progress
        self._warm_up = warm_up
        self._start()

    def submit(self, compute: Compute, ticket: Ticket, args: Any) -> "Future[Any]":
        return self._pool.submit(worker.run, compute, ticket, args)

    def rebuild(self) -> None:
        """Replace a broken pool."""
        self.close()
        self._start()

    def close(self) -> None:
        """End the processes now; what they compute is pure and can be computed again."""
        self._closed.set()
        processes = list((self._pool._processes or {}).values())  # there is no public way before Python 3.14
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        for process in processes:
            process.join()
        self._pool.shutdown(wait=True)
        self._reader.join()
        self._messages.close()
        self._messages.join_thread()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._messages: Any = context.Queue()  # a new one per pool: a killed worker may leave the old one locked
        self._closed = threading.Event()
        self._pool: Any = ProcessPoolExecutor(
            self.slots, mp_context=context, initializer=worker.initialise, initargs=(self._messages, self._warm_up)
        )
        self._reader = threading.Thread(target=self._read, args=(self._messages, self._closed), name="job-progress", daemon=True)
        self._reader.start()
        self._pool.submit(worker.ready)

    def _read(self, messages: Any, closed: threading.Event) -> None:
        while not closed.is_set():
            try:
                ticket, fraction, message = messages.get(timeout=0.2)
            except queue.Empty:
                continue
            self._progress(ticket, fraction, message)
