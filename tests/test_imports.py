"""HOUSE.md section 1 as a test: who may import whom, and what the core may use at all."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
APP = ROOT / "app"
CORE = ("geometry", "sequencing", "learning", "robot")
ALLOWED: dict[str, set[str]] = {
    "errors": set(),
    "settings": set(),
    "prepare": {"settings"},
    "geometry": {"errors"},
    "sequencing": {"errors", "geometry"},
    "learning": {"errors", "geometry", "sequencing"},
    "robot": {"errors", "geometry", "sequencing"},
    "storage": {"errors", "settings", *CORE},
    "jobs": {"errors", "settings", "storage"},
    "workflow": {"errors", "settings", "storage", "jobs", *CORE},
    "api": {"errors", "settings", "workflow", *CORE},
    "viewer": {"errors", "settings", "workflow", *CORE},
    "main": {"errors", "settings", "storage", "jobs", "workflow", "api", "viewer"},
    "benches": {"errors", "settings", "workflow", "viewer", *CORE},
    "cli": {"errors", "settings", "prepare", "storage", "workflow", "main", "benches", *CORE},
}
CORE_THIRD_PARTY = {"numpy", "scipy", "numba", "llvmlite", "trimesh", "mujoco", "clarabel", "cascadio", "networkx"}
FORBIDDEN_IN_CORE = {
    "threading",
    "asyncio",
    "time",
    "datetime",
    "random",
    "logging",
    "sqlite3",
    "socket",
    "concurrent",
    "queue",
    "uuid",
    "secrets",
}
SEEDED_RANDOM = {"Generator", "default_rng", "PCG64", "SeedSequence", "BitGenerator"}


def sources(folder: Path = APP) -> list[Path]:
    return sorted(folder.rglob("*.py"))


def owner(path: Path) -> str:
    """The part a file belongs to: its folder under app/, or its own name."""
    parts = path.relative_to(APP).parts
    return parts[0] if len(parts) > 1 else path.stem


def imports(tree: ast.AST, package: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], int]]:
    """Every imported dotted name with its line; relative ones made absolute."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield tuple(alias.name.split(".")), node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            name = base + tuple((node.module or "").split(".") if node.module else ())
            if name == ("app",):
                for alias in node.names:
                    yield (*name, alias.name), node.lineno
            else:
                yield name, node.lineno


def imported(path: Path) -> list[tuple[tuple[str, ...], int]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return list(imports(tree, path.relative_to(ROOT).with_suffix("").parts[:-1]))


def wrong_edges(here: str, names: list[tuple[tuple[str, ...], int]]) -> list[str]:
    return [
        f"line {line}: {here} must not import app.{name[1]}"
        for name, line in names
        if name[0] == "app" and len(name) > 1 and name[1] != here and name[1] not in ALLOWED[here]
    ]


def wrong_packages(names: list[tuple[tuple[str, ...], int]]) -> list[str]:
    return [
        f"line {line}: the core must not use {name[0]}"
        for name, line in names
        if name[0] in FORBIDDEN_IN_CORE or (name[0] not in sys.stdlib_module_names and name[0] != "app" and name[0] not in CORE_THIRD_PARTY)
    ]


@pytest.mark.parametrize("path", sources(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_follow_the_direction(path: Path) -> None:
    here = owner(path)
    if path == APP / "__init__.py":
        here = "errors"  # the package itself imports nothing of the application
    assert wrong_edges(here, imported(path)) == []


@pytest.mark.parametrize("path", [p for p in sources() if owner(p) in CORE], ids=lambda p: str(p.relative_to(ROOT)))
def test_the_core_is_pure(path: Path) -> None:
    assert wrong_packages(imported(path)) == []
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prints = [n.lineno for n in ast.walk(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name) and n.func.id == "print"]
    assert prints == [], "the core prints nothing"
    shared_state = [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Attribute)
        and node.value.attr == "random"
        and isinstance(node.value.value, ast.Name)
        and node.value.value.id in ("np", "numpy")
        and node.attr not in SEEDED_RANDOM
    ]
    assert shared_state == [], "randomness arrives as a Generator"


@pytest.mark.parametrize(
    ("here", "line"),
    [
        ("geometry", "from app.sequencing.problem import SequencingProblem"),
        ("robot", "import app.learning.policy"),
        ("api", "from app.viewer import Hub"),
        ("api", "from app import storage"),
        ("viewer", "from ..api import errors"),
        ("workflow", "from app.main import create_app"),
    ],
)
def test_a_wrong_edge_is_found(here: str, line: str) -> None:
    found = list(imports(ast.parse(line), ("app", here)))
    assert len(wrong_edges(here, found)) == 1


@pytest.mark.parametrize(
    "line", ["import fastapi", "from sqlmodel import Field", "import threading", "import viser.transforms", "import time"]
)
def test_a_wrong_package_in_the_core_is_found(line: str) -> None:
    assert len(wrong_packages(list(imports(ast.parse(line), ("app", "geometry"))))) == 1


def test_every_part_is_in_the_table() -> None:
    parts = {owner(path) for path in sources() if path != APP / "__init__.py"}
    assert parts - set(ALLOWED) == set()
