"""The life of a job: done, failed in words, cancelled, taken up after a stop, retried when a worker dies."""

import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import Session

from app.errors import InvalidInput
from app.jobs.dispatcher import GENERIC, Handler, Jobs
from app.jobs.rows import add_job, cancel_jobs
from app.jobs.worker import Report
from app.settings import Settings
from app.storage import Store, migrate
from app.storage.tables import Idempotency, JobRow, Project


def double(args: int, report: Report) -> int:
    report(0.5, "Doubling")
    return 2 * args


def refuse(args: int, report: Report) -> int:
    raise InvalidInput(f"{args} can't be doubled.")


def crash(args: int, report: Report) -> int:
    raise ZeroDivisionError("secret detail")


def die_once(args: str, report: Report) -> str:
    """Ends its process the first time."""
    marker = Path(args)
    if not marker.exists():
        marker.touch()
        os._exit(9)
    return "alive"


class Bench:
    """A store with one project, and handlers that write down what happens to them."""

    def __init__(self, settings: Settings) -> None:
        migrate(settings)
        self.settings = settings
        self.store = Store(settings)
        self.project = self.store.write(_project)
        self.failures: list[tuple[str, dict[str, str]]] = []
        self.jobs: Jobs | None = None

    def start(self, compute: Callable[[Any, Report], Any], prepare: Callable[[Session, JobRow], Any] | None = None) -> Jobs:
        handler = Handler(prepare or (lambda _session, job: job.args["value"]), compute, _store_result, self._failed)
        self.jobs = Jobs(self.store, self.settings)
        self.jobs.register("kind", handler)
        self.jobs.start()
        return self.jobs

    def _failed(self, _session: Session, job: JobRow, error: dict[str, str]) -> None:
        self.failures.append((job.id, error))

    def add(self, value: Any = 21, subject: str = "subject") -> str:
        return self.store.write(lambda session: add_job(session, "kind", self.project, subject, "Work", {"value": value}))

    def row(self, job: str) -> JobRow:
        return self.store.read(lambda session: session.get_one(JobRow, job))

    def result(self, job: str) -> str | None:
        return self.store.read(lambda session: (found := session.get(Idempotency, job)) and found.body)

    def close(self) -> None:
        if self.jobs is not None:
            self.jobs.close()
            self.jobs = None


def _project(session: Session) -> str:
    row = Project(name="P", interactions=[])
    session.add(row)
    return row.id


def _store_result(session: Session, job: JobRow, output: Any) -> None:
    """Results land in a table that has nothing else in it here."""
    session.add(Idempotency(key=job.id, request_hash="", status=0, headers={}, body=str(output)))


@pytest.fixture
def bench(settings: Settings) -> Iterator[Bench]:
    made = Bench(settings)
    yield made
    made.close()
    made.store.close()


def test_a_job_is_done(bench: Bench) -> None:
    jobs = bench.start(double)
    job = bench.add()
    assert jobs.wait_idle(10)
    row = bench.row(job)
    assert (row.state, row.fraction, row.attempt, bench.result(job)) == ("done", 1.0, 1, "42")
    told = [e.data for e in bench.store.events_after(0, bench.project) if e.type == "job.progress"]
    assert [(t["state"], t["fraction"]) for t in told] == [("queued", 0.0), ("running", 0.0), ("running", 0.5), ("done", 1.0)]


def test_an_error_in_words_reaches_the_subject(bench: Bench) -> None:
    jobs = bench.start(refuse)
    job = bench.add()
    assert jobs.wait_idle(10)
    told = {"error": "InvalidInput", "detail": "21 can't be doubled."}
    assert (bench.row(job).state, bench.row(job).error) == ("failed", told)
    assert bench.failures == [(job, told)]


def test_a_bug_is_logged_and_told_without_detail(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    jobs = bench.start(crash)
    job = bench.add()
    assert jobs.wait_idle(10)
    assert bench.row(job).error == {"error": "InternalError", "detail": GENERIC}
    assert "secret detail" in caplog.text


def test_a_job_whose_subject_is_gone_is_cancelled(bench: Bench) -> None:
    jobs = bench.start(double, prepare=lambda _session, _job: None)
    job = bench.add()
    assert jobs.wait_idle(10)
    assert (bench.row(job).state, bench.result(job)) == ("cancelled", None)


def test_a_result_that_arrives_after_cancelling_is_dropped(bench: Bench) -> None:
    started, go_on = threading.Event(), threading.Event()

    def slow(args: int, report: Report) -> int:
        started.set()
        go_on.wait(10)
        return args

    jobs = bench.start(slow)
    job, other = bench.add(), bench.add(subject="other")
    assert started.wait(10)
    bench.store.write(lambda session: cancel_jobs(session, "subject"))
    go_on.set()
    assert jobs.wait_idle(10)
    assert (bench.row(job).state, bench.result(job)) == ("cancelled", None)
    assert (bench.row(other).state, bench.result(other)) == ("done", "21")


def test_queued_and_interrupted_jobs_go_on_after_a_restart(bench: Bench) -> None:
    """A row that says running belongs to a server that is gone."""
    interrupted, queued = bench.add(1), bench.add(2)

    def interrupt(session: Session) -> None:
        row = session.get_one(JobRow, interrupted)
        row.state, row.attempt = "running", 1
        session.add(row)

    bench.store.write(interrupt)
    jobs = bench.start(double)
    assert jobs.wait_idle(10)
    assert [bench.result(job) for job in (interrupted, queued)] == ["2", "4"]
    assert bench.row(interrupted).attempt == 2


def test_closing_returns_every_thread(bench: Bench) -> None:
    before = threading.active_count()
    jobs = bench.start(double)
    bench.add()
    assert jobs.wait_idle(10)
    bench.close()
    assert threading.active_count() == before


def test_worker_processes_compute_and_a_dead_one_is_replaced(bench: Bench, tmp_path: Path) -> None:
    """The worker kills itself during the first attempt; the second one gives the result."""
    bench.settings = bench.settings.model_copy(update={"executor": "processes"})
    before = threading.active_count()
    jobs = bench.start(die_once)
    job = bench.add(str(tmp_path / "marker"))
    assert jobs.wait_idle(90)
    assert (bench.row(job).state, bench.row(job).attempt, bench.result(job)) == ("done", 2, "alive")
    bench.close()
    assert threading.active_count() == before
