"""Compiled functions whose kept machine code is renewed when any file they may have been compiled from has changed.

Numba keeps compiled code on disk per source file and looks at that file alone. But a compiled function contains what it calls, and
the arrays of constants it reads, also from other files: after a change there the old code would go on running. Here code counts
as old as soon as one of the files with compiled functions in the same folder is another one.
"""

import hashlib
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, ClassVar, TypeVar, overload

import numba as nb
from numba.core import caching  # its classes for extending the cache aren't documented; tests/geometry/test_compiled.py guards this

F = TypeVar("F", bound=Callable[..., Any])
MARK = b"@kernel"


@overload
def kernel(function: F) -> F: ...


@overload
def kernel(**options: Any) -> Callable[[F], F]: ...


def kernel(function: Any = None, **options: Any) -> Any:
    """Compile on first use, or load what was compiled from the same sources; options are those of `numba.njit`."""
    if function is None:
        return partial(kernel, **options)
    compiled: Any = nb.njit(**options)(function)
    compiled._cache = _FolderCache(function)
    return compiled


@lru_cache
def _stamp(folder: Path) -> bytes:
    """What all files with compiled functions in a folder say."""
    sources = (path.read_bytes() for path in sorted(folder.glob("*.py")))
    return hashlib.sha256(b"\0".join(source for source in sources if MARK in source)).digest()


class _ByFolder:
    """Where code is kept stays as Numba has it; only what it was compiled from is the whole folder."""

    _py_file: str

    def get_source_stamp(self) -> bytes:
        return _stamp(Path(self._py_file).parent)


class _Chosen(_ByFolder, caching.UserProvidedCacheLocator):
    pass


class _InTree(_ByFolder, caching.InTreeCacheLocator):
    pass


class _UserWide(_ByFolder, caching.UserWideCacheLocator):
    pass


class _FolderCacheImpl(caching.CompileResultCacheImpl):
    _locator_classes: ClassVar = [_Chosen, _InTree, _UserWide]


class _FolderCache(caching.FunctionCache):
    _impl_class = _FolderCacheImpl
