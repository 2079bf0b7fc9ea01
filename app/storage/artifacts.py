"""Files named by their content, beside the database: meshes, tools, playbacks."""

import hashlib
import os
import tempfile
from pathlib import Path

from sqlmodel import Session

from app.errors import NotFound
from app.storage.tables import Artifact


class Artifacts:
    """`folder/ab/abcdef...`: written to a temporary file, synced, renamed; never changed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def path(self, sha: str) -> Path:
        """Where the content is or would be."""
        return self._folder / sha[:2] / sha

    def put(self, content: bytes) -> str:
        """Store the content for good and return its sha256; the same content is stored once."""
        sha = hashlib.sha256(content).hexdigest()
        target = self.path(sha)
        if target.exists():
            return sha
        target.parent.mkdir(exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=self._folder, prefix=".new-")
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, target)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
        _sync_folder(target.parent)
        _sync_folder(self._folder)
        return sha

    def get(self, sha: str) -> bytes:
        """The content.

        Raises:
            NotFound: There is no such file.
        """
        try:
            return self.path(sha).read_bytes()
        except FileNotFoundError:
            raise NotFound(f"The stored file {sha[:12]} is missing from the data folder.") from None


def keep(session: Session, sha: str, size: int, media_type: str) -> str:
    """Note in the database that a stored file is in use; call it in the transaction that refers to it."""
    if session.get(Artifact, sha) is None:
        session.add(Artifact(sha=sha, size=size, media_type=media_type))
        session.flush()
    return sha


def _sync_folder(folder: Path) -> None:
    """Make a rename in `folder` survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
