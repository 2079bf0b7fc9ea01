"""Stored answers to POSTs that came with a key."""

from typing import Any

from sqlmodel import Session

from app.errors import InvalidInput
from app.storage.tables import Idempotency
from app.workflow.context import Context


def recall(ctx: Context, key: str, request_hash: str) -> dict[str, Any] | None:
    """The stored answer, None for a new key.

    Raises:
        InvalidInput: The key belongs to another request.
    """

    def query(session: Session) -> dict[str, Any] | None:
        row = session.get(Idempotency, key)
        if row is None:
            return None
        if row.request_hash != request_hash:
            raise InvalidInput("This Idempotency-Key was used for another request; use a new key for each new action.")
        return {"status": row.status, "headers": row.headers, "body": row.body}

    return ctx.store.read(query)


def remember(ctx: Context, key: str, request_hash: str, status: int, headers: dict[str, str], body: str) -> None:
    """Store an answer; the first one stays."""

    def change(session: Session) -> None:
        if session.get(Idempotency, key) is None:
            session.add(Idempotency(key=key, request_hash=request_hash, status=status, headers=headers, body=body))

    ctx.store.write(change)
