"""Tables, the single writer, short readers, files named by content, and the conversions between rows and core values."""

from app.storage.migration import migrate
from app.storage.outbox import Event, emit
from app.storage.store import Store

__all__ = ["Event", "Store", "emit", "migrate"]
