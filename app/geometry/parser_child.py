"""The process that parses files: `python -m app.geometry.parser_child`, started once and kept ready.

Native parsers may crash, hang or eat all memory on a hostile file, so they only ever run here. Importing them takes
seconds; this process does it once and then forks a child with hard limits for every file. A request is one JSON line on
stdin: {"folder", "input", "kind", "seconds"}. The child leaves `result.npz` or `error.json` in the folder; the line on
stdout says how it ended: "done", "stopped" (out of time) or "crashed".
"""

import json
import os
import resource
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import AppError
from app.geometry.cleaning import areas, components
from app.geometry.parsing import parse

MEMORY_BYTES = 6 * 2**30
CPU_SECONDS = 120


def answer(request: dict[str, Any]) -> None:
    """Parse one file and write what came out of it."""
    folder = Path(request["folder"])
    try:
        content = parse(Path(request["input"]).read_bytes(), request["kind"]).to_bytes()
    except AppError as error:
        (folder / "error.json").write_text(json.dumps({"error": type(error).__name__, "detail": str(error)}))
    except MemoryError:
        words = "Reading it needs more memory than is allowed. Export it more coarsely."
        (folder / "error.json").write_text(json.dumps({"error": "TooLarge", "detail": words}))
    else:
        (folder / "result.npz").write_bytes(content)


def run_child(request: dict[str, Any]) -> None:
    """In the forked process: set the limits, keep quiet, answer, end without any clean-up of the parent's state."""
    code = 1
    try:
        silence = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silence, stream)
        os.chdir(request["folder"])
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.setitimer(signal.ITIMER_REAL, request["seconds"])  # its default action ends native code, too
        answer(request)
        code = 0
    finally:
        os._exit(code)


def main() -> None:
    """Serve requests until stdin ends."""
    areas(np.eye(3), np.array([[0, 1, 2]]))  # compiled, or loaded, once for all children
    components(np.array([[0, 1, 2]]))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C belongs to the server, which then closes stdin
    for line in iter(sys.stdin.buffer.readline, b""):
        child = os.fork()
        if child == 0:
            run_child(json.loads(line))
        _, status = os.waitpid(child, 0)
        stopped = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGALRM, signal.SIGXCPU)
        word = "stopped" if stopped else "done" if status == 0 else "crashed"
        sys.stdout.buffer.write(word.encode() + b"\n")
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
