"""The single writer: everything committed or nothing, one bad request harms no other."""

import threading
from collections.abc import Iterator

import pytest
from sqlalchemy.exc import IntegrityError
from sqlmodel import Session, col, func, select

from app.settings import Settings
from app.storage import Event, Store, emit, migrate
from app.storage.identity import new_id
from app.storage.tables import EventRow, Idempotency, Project
from app.storage.writer import StoreClosed, TransactionLost


@pytest.fixture
def store(settings: Settings) -> Iterator[Store]:
    migrate(settings)
    opened = Store(settings)
    yield opened
    opened.close()


def key_row(key: str) -> Idempotency:
    return Idempotency(key=key, request_hash="h", status=200, headers={}, body="")


def keys(store: Store) -> set[str]:
    return store.read(lambda session: set(session.exec(select(Idempotency.key))))


def test_many_threads_lose_nothing_and_share_commits(store: Store) -> None:
    """8 threads, 40 writes each; queued together they take far fewer commits than writes."""
    gate = threading.Event()
    store.writer.submit(lambda _session: gate.wait(10))
    futures = []
    lock = threading.Lock()

    def work(name: int) -> None:
        for i in range(40):
            future = store.writer.submit(lambda session, i=i: session.add(key_row(f"{name}-{i}")))
            with lock:
                futures.append(future)

    threads = [threading.Thread(target=work, args=(name,)) for name in range(8)]
    before = store.writer.commits
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    gate.set()
    for future in futures:
        future.result(10)
    assert keys(store) == {f"{name}-{i}" for name in range(8) for i in range(40)}
    assert store.writer.commits - before <= 10


def test_reading_then_writing_never_loses_an_update(store: Store) -> None:
    """50 increments from 5 threads give 50: each sees what the one before wrote."""
    project = store.write(lambda session: _add_project(session))

    def increment(session: Session) -> None:
        row = session.get_one(Project, project)
        row.version += 1
        session.add(row)

    threads = [threading.Thread(target=lambda: [store.write(increment) for _ in range(10)]) for _ in range(5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.read(lambda session: session.get_one(Project, project).version) == 51


def _add_project(session: Session) -> str:
    row = Project(name="P", interactions=[])
    session.add(row)
    return row.id


def test_a_duplicate_fails_alone(store: Store) -> None:
    gate = threading.Event()
    store.writer.submit(lambda _session: gate.wait(10))
    futures = [store.writer.submit(lambda session, key=key: session.add(key_row(key))) for key in ("a", "a", "b")]
    gate.set()
    assert futures[0].exception(10) is None
    assert isinstance(futures[1].exception(10), IntegrityError)
    assert futures[2].exception(10) is None
    assert keys(store) == {"a", "b"}


def test_what_a_failed_write_did_is_gone(store: Store) -> None:
    def broken(session: Session) -> None:
        session.add(key_row("half"))
        session.flush()
        emit(session, "project.changed", None)
        raise KeyError("oops")

    with pytest.raises(KeyError, match="oops"):
        store.write(broken)
    assert keys(store) == set()
    assert store.events_after(0) == []


def test_a_cancelled_write_is_skipped_and_the_thread_lives(store: Store) -> None:
    gate = threading.Event()
    store.writer.submit(lambda _session: gate.wait(10))
    waiting = store.writer.submit(lambda session: session.add(key_row("never")))
    assert waiting.cancel()
    gate.set()
    store.write(lambda session: session.add(key_row("after")))
    assert keys(store) == {"after"}


def test_a_lost_transaction_fails_its_whole_batch(store: Store) -> None:
    """As when the disk is full: nothing of the batch may be acknowledged."""
    gate = threading.Event()
    store.writer.submit(lambda _session: gate.wait(10))
    actions = [
        lambda session: session.add(key_row("d")),
        lambda session: session.connection().connection.dbapi_connection.execute("ROLLBACK"),
        lambda session: session.add(key_row("e")),
    ]
    futures = [store.writer.submit(action) for action in actions]
    gate.set()
    errors = [future.exception(10) for future in futures]
    assert all(error is not None for error in errors)
    assert any(isinstance(error, TransactionLost) for error in errors)
    assert keys(store) == set()
    store.write(lambda session: session.add(key_row("next")))
    assert keys(store) == {"next"}


def test_events_come_after_the_commit_and_in_order(store: Store) -> None:
    """A subscriber that looks into the database finds what the event tells of."""
    seen: list[tuple[Event, int]] = []
    done = threading.Event()

    def heard(event: Event) -> None:
        seen.append((event, store.read(lambda session: session.exec(select(func.count()).select_from(Idempotency)).one())))
        if len(seen) == 3:
            done.set()

    unsubscribe = store.subscribe(heard)
    for k in range(3):
        store.write(lambda session, k=k: (session.add(key_row(str(k))), emit(session, "tool.changed", "p", tool_id=str(k)))[0])
    assert done.wait(10)
    unsubscribe()
    assert [event.data for event, _ in seen] == [{"tool_id": "0"}, {"tool_id": "1"}, {"tool_id": "2"}]
    assert all(count >= k + 1 for k, (_, count) in enumerate(seen))
    assert [e.id for e in store.events_after(seen[0][0].id, "p")] == [seen[1][0].id, seen[2][0].id]
    assert store.events_after(0, "other") == []
    store.write(lambda session: emit(session, "tool.changed", "p", tool_id="3"))
    assert len(seen) == 3


def test_readers_cannot_write(store: Store) -> None:
    with pytest.raises(Exception, match="readonly"):
        store.read(lambda session: (session.add(key_row("no")), session.flush()))


def test_a_closed_store_refuses_and_leaves_no_thread(settings: Settings) -> None:
    migrate(settings)
    before = threading.active_count()
    store = Store(settings)
    store.close()
    assert threading.active_count() == before
    with pytest.raises(StoreClosed):
        store.writer.submit(lambda _session: None)


def test_old_events_are_forgotten_at_the_start(settings: Settings) -> None:
    migrate(settings)
    store = Store(settings)
    old = EventRow(type="tool.changed", project_id=None, data={}, created_at="2020-01-01T00:00:00.000Z")
    store.write(lambda session: (session.add(old), emit(session, "project.changed", None))[0])
    store.close()
    store = Store(settings)
    kinds = store.read(lambda session: list(session.exec(select(EventRow.type).order_by(col(EventRow.id)))))
    store.close()
    assert kinds == ["project.changed"]


def test_ids_sort_by_creation() -> None:
    ids = [new_id() for _ in range(2000)]
    assert ids == sorted(ids)
    assert len(set(ids)) == 2000
