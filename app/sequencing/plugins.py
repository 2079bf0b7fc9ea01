"""Features that an engineer adds: a short Python file, carried by value so that every process computes the same.

A file defines KEY (a word), LABEL (plain words) and `values(graph, done)`; docs/features.md has an example. The text of the
file is the feature's version: a policy names it, and goes on using the text it was learned with after the file has changed.
"""

import hashlib
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from app.errors import InvalidFeature
from app.geometry.tool import Array, RegionGraph
from app.sequencing.structure import Sets

KEY = re.compile(r"[a-z][a-z0-9_]{1,39}")
LONGEST = 60  # characters of a label
MOST_TEXT = 100_000


@dataclass(frozen=True)
class OwnFeature:
    """A feature by its source text; equal texts are equal features, in any process."""

    source: str

    @property
    def key(self) -> str:
        return _module(self.source).KEY

    @property
    def label(self) -> str:
        return _module(self.source).LABEL

    @property
    def version(self) -> str:
        """Eight hexadecimal digits of the text's SHA-256."""
        return hashlib.sha256(self.source.encode()).hexdigest()[:8]

    def __call__(self, graph: RegionGraph, done: Sets) -> Array:
        return _module(self.source).values(graph, done)


def read_own_feature(path: Path) -> OwnFeature:
    """The feature that a file defines; `contract_faults` says whether it may be used.

    Raises:
        InvalidFeature: Not UTF-8, not Python, or KEY, LABEL or values are missing or malformed.
    """
    try:
        source = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFeature(f"{path.name} can't be read as text: {error}.") from error
    if len(source) > MOST_TEXT:
        raise InvalidFeature(f"{path.name} is longer than {MOST_TEXT} characters; a feature is a short function.")
    own = OwnFeature(source)
    try:
        module = _module(source)
    except Exception as error:  # an engineer's own code may fail in any way
        raise InvalidFeature(f"{path.name} stopped while it was read, {type(error).__name__}: {error}") from error
    _check(path.name, module)
    return own


def _check(file_name: str, module: Any) -> None:
    key, label = getattr(module, "KEY", None), getattr(module, "LABEL", None)
    if not isinstance(key, str) or not KEY.fullmatch(key):
        raise InvalidFeature(f"{file_name} needs KEY = '...': 2 to 40 small letters, digits and underscores; it has {key!r}.")
    if not isinstance(label, str) or not 1 <= len(label.strip()) <= LONGEST:
        raise InvalidFeature(
            f"{file_name} needs LABEL = '...': what people call the feature, at most {LONGEST} characters; it has {label!r}."
        )
    if not callable(getattr(module, "values", None)):
        raise InvalidFeature(f"{file_name} needs a function values(graph, done).")


@lru_cache(maxsize=64)
def _module(source: str) -> Any:
    module = ModuleType("own_feature")
    exec(compile(source, "<own feature>", "exec"), module.__dict__)
    return module
