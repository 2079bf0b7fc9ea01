"""The pages work without a build step and under their content policy: no inline script, and every file they name exists."""

import re
from pathlib import Path

import pytest

STATIC = Path(__file__).resolve().parents[2] / "static"
PAGES = sorted(STATIC.glob("*.html"))
MODULES = sorted((STATIC / "js").rglob("*.js"))
IMPORT = re.compile(r"""(?:from|import)\s*\(?\s*["'](\.[^"']+)["']""")
NAMED_IMPORT = re.compile(r"""import\s*\{([^}]*)\}\s*from\s*["'](\.[^"']+)["']""")
EXPORT = re.compile(r"export\s+(?:async\s+)?(?:const|let|function\*?|class)\s+(\w+)")


def named(path: Path) -> str:
    return path.relative_to(STATIC).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_page_has_no_inline_script_or_handler(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    bodies = re.findall(r"<script\b[^>]*>(.*?)</script>", text, re.DOTALL)
    assert [body for body in bodies if body.strip()] == []
    assert re.findall(r"\son\w+\s*=", text) == []


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_page_names_only_files_that_exist(page: Path) -> None:
    addresses = re.findall(r"""(?:src|href)="(/static/[^"]+)\"""", page.read_text(encoding="utf-8"))
    assert addresses, f"{page.name} loads nothing"
    assert [a for a in addresses if not (STATIC / a.removeprefix("/static/")).is_file()] == []


@pytest.mark.parametrize("module", MODULES, ids=named)
def test_module_imports_only_what_its_siblings_export(module: Path) -> None:
    text = module.read_text(encoding="utf-8")
    missing = [name for name in IMPORT.findall(text) if not (module.parent / name).is_file()]
    for names, source in NAMED_IMPORT.findall(text):
        file = module.parent / source
        exported = set(EXPORT.findall(file.read_text(encoding="utf-8"))) if file.is_file() else set()
        wanted = {name.split(" as ")[0].strip() for name in names.split(",") if name.strip()}
        missing += [f"{name} from {source}" for name in sorted(wanted - exported)]
    assert missing == []


@pytest.mark.parametrize("module", MODULES, ids=named)
def test_module_writes_no_markup_strings(module: Path) -> None:
    """Names typed by people must never become HTML."""
    assert re.findall(r"\b(?:innerHTML|outerHTML|insertAdjacentHTML|document\.write)\b", module.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("file", [*PAGES, *MODULES], ids=named)
def test_file_stays_small(file: Path) -> None:
    assert len(file.read_text(encoding="utf-8").splitlines()) < 400
