"""The installed viser's single page, made to fit into ours: script first in its head, styles, and a content policy."""

import gzip
import json
from dataclasses import astuple
from functools import lru_cache
from pathlib import Path

import viser

from app.viewer.palette import DARK, LIGHT, Theme
from app.viewer.shaders import CHANGES

POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src 'self' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "connect-src 'self' data: blob:; frame-ancestors 'self'; object-src 'none'; base-uri 'none'; form-action 'none'"
)
# never `websocket` or `playbackPath`: with them a foreign server could run script on our origin
PARAMETERS = frozenset(
    {
        "hideViserLogo", "darkMode", "fixedDpr", "showStats",
        "initialCameraPosition", "initialCameraLookAt", "initialCameraUp", "initialCameraFov",
    }
)  # fmt: skip

# 1. viser reconnects only while the document has the focus, which a frame rarely has.
# 2. `darkMode` is only the theme of the first frame; left in place it would outvote a later change.
# 3. viser writes its websocket's address into the page's own, which our list of parameters refuses at the next reload.
# 4. No notice about software rendering over the part.
# 5. The shaders.
SCRIPT = """
document.hasFocus = () => !document.hidden;
document.addEventListener("visibilitychange", () => dispatchEvent(new Event("focus")));
{
  const replace = history.replaceState.bind(history);
  history.replaceState = (state, title, address) => {
    const tidy = new URL(address, location.href);
    for (const name of ["websocket", "darkMode"]) tidy.searchParams.delete(name);
    replace(state, title, tidy.href);
  };
  if (new URL(location.href).searchParams.has("darkMode")) document.documentElement.dataset.mantineColorScheme = "dark";
  history.replaceState(null, "", location.href);

  const context = WebGL2RenderingContext.prototype;
  const [extension, source] = [context.getExtension, context.shaderSource];
  context.getExtension = function (name) {
    return name === "WEBGL_debug_renderer_info" ? null : extension.call(this, name);
  };
  const changes = CHANGES;
  context.shaderSource = function (shader, text) {
    for (const [mark, old, ours] of changes) if (text.includes(mark)) text = text.replace(old, ours);
    source.call(this, shader, text);
  };
}
"""
# viser's own panels, floating on wide screens and at the bottom of narrow ones, are hidden: our pages have the controls
STYLE = """
html {{ background: linear-gradient({light}); }}
html[data-mantine-color-scheme="dark"] {{ background: linear-gradient({dark}); }}
body, #root, #root div:has(canvas) {{ background: none !important; }}
[data-floating-window], #root div:has(canvas) + .mantine-Paper-root {{ display: none !important; }}
"""


@lru_cache(maxsize=1)
def viewer_page() -> tuple[bytes, bytes]:
    """The page, plain and compressed."""
    page = installed_page().read_bytes()
    if page.count(b"<head>") != 1:
        raise RuntimeError("viser's page changed: expected exactly one <head>")
    script = SCRIPT.replace("CHANGES", json.dumps([astuple(change) for change in CHANGES]))
    style = STYLE.format(light=_ground(LIGHT), dark=_ground(DARK))
    page = page.replace(b"<head>", f"<head><script>{script}</script><style>{style}</style>".encode(), 1)
    return page, gzip.compress(page, 6)


def installed_page() -> Path:
    """The single file viser's client was built into."""
    return Path(str(viser.__file__)).parent / "client" / "build" / "index.html"


def _ground(theme: Theme) -> str:
    return f"{theme.scene_top}, {theme.scene_bottom}"
