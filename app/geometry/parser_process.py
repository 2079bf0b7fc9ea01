"""Talking to the process that parses files. One is kept ready, as starting one takes seconds; two at most stay."""

import atexit
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from app import errors
from app.errors import UnreadableMesh
from app.geometry.parsed import ParsedFile
from app.geometry.sniffing import FORMAT_NAMES

WALL_SECONDS = 180.0
MOST_IDLE = 2
ROOT = Path(__file__).resolve().parents[2]

_idle: list[subprocess.Popen[bytes]] = []  # pop and append are atomic: a process never serves two callers


def warm_up() -> None:
    """Start a process, unless one is ready; returns at once."""
    if not _idle:
        _idle.append(_start())


def shut_down() -> None:
    """End the processes that wait."""
    while _idle:
        _end(_idle.pop())


def parse_apart(path: Path, kind: str, file_name: str) -> ParsedFile:
    """Parse a file in another process; every end but a result becomes a sentence about the file.

    Raises:
        UnreadableMesh, TooLarge: The file can't be used; the message says why.
    """
    with tempfile.TemporaryDirectory(prefix="apprentice-import-") as name:
        folder = Path(name)
        request = {"folder": name, "input": str(path.resolve()), "kind": kind, "seconds": WALL_SECONDS}
        end = _ask(json.dumps(request).encode() + b"\n")
        if end == b"done" and (folder / "error.json").exists():  # a child that crashed may have left half of one
            error = json.loads((folder / "error.json").read_text())
            raise getattr(errors, error["error"])(f"{file_name}: {error['detail']}")
        if end == b"done" and (folder / "result.npz").exists():
            return ParsedFile.from_bytes((folder / "result.npz").read_bytes())
    if end == b"stopped":
        raise UnreadableMesh(f"{file_name}: reading took longer than {WALL_SECONDS:.0f} s and was stopped. Export it more coarsely.")
    raise UnreadableMesh(f"{file_name} is damaged: the {FORMAT_NAMES[kind]} reader can't make sense of it. Export it again.")


def _ask(line: bytes) -> bytes:
    """Send a request to a waiting process; one that has died meanwhile is replaced once."""
    for _ in range(2):
        process = _take()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(line)
            process.stdin.flush()
            end = process.stdout.readline().strip()
        except BrokenPipeError:
            end = b""
        if end:
            _give_back(process)
            return end
        _end(process)
    raise RuntimeError("the process that parses files does not start")


def _take() -> subprocess.Popen[bytes]:
    try:
        return _idle.pop()
    except IndexError:
        return _start()


def _give_back(process: subprocess.Popen[bytes]) -> None:
    if len(_idle) < MOST_IDLE:
        _idle.append(process)
    else:
        _end(process)


def _start() -> subprocess.Popen[bytes]:
    atexit.unregister(shut_down)
    atexit.register(shut_down)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "app.geometry.parser_child"]
    return subprocess.Popen(
        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True
    )


def _end(process: subprocess.Popen[bytes]) -> None:
    """End an idle process and collect what is left of it."""
    process.kill()
    process.communicate()
