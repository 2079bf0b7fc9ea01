"""Compiles what is computed often, once after each change of the code, so that nobody waits for a compiler later.

Numba keeps what it compiled beside the sources. Imports nothing of the application: a look at the stamp must take no time.
"""

import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress

from app.settings import ROOT

STAMP = ROOT / "app" / "__pycache__" / "compiled"  # is cleared away together with what it stands for
SHARES = (  # compiled side by side; each takes its functions from app/workflow/handlers.py
    "WARM_UP[:1]",
    "WARM_UP[1:]",
)
COMPILE = """
from importlib import import_module
from app.workflow.handlers import WARM_UP
for name in {share}:
    module, function = name.rsplit(".", 1)
    getattr(import_module(module), function)()
"""


def compile_once(say: Callable[[str], None]) -> None:
    """Compile all kernels unless that was done for these sources; what can't be compiled now is compiled when it is needed."""
    wanted = sources_digest()
    if STAMP.exists() and STAMP.read_text() == wanted:
        return
    say("Compiling for this machine; once, and takes one to three minutes ...")
    processes = [subprocess.Popen([sys.executable, "-c", COMPILE.format(share=share)], cwd=ROOT) for share in SHARES]
    if any([process.wait() for process in processes]):
        say("Not everything could be compiled beforehand; the first answers will take longer.")
        return
    with suppress(OSError):  # a folder nobody may write to: Numba keeps its code elsewhere, and looks itself what is old
        STAMP.parent.mkdir(exist_ok=True)
        STAMP.write_text(wanted)


def sources_digest() -> str:
    """Of all sources and of where Numba keeps its code."""
    texts = (
        path.read_bytes() for folder in ("geometry", "sequencing", "learning") for path in sorted((ROOT / "app" / folder).glob("*.py"))
    )
    return hashlib.sha256(b"\0".join((os.environ.get("NUMBA_CACHE_DIR", "").encode(), sys.version.encode(), *texts))).hexdigest()
