"""The installed viser's single page, made to fit into ours: script first in its head, styles, and a content policy."""

import gzip
from functools import lru_cache
from pathlib import Path

import viser

from app.viewer.palette import DARK, LIGHT, Theme, rgb

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

# Lines of viser's label shaders (client/src/label/LabelRenderer.tsx) that the page replaces. A label sized in the scene is a
# letter without a plate, and the sign of its height chooses the ink; one sized on the screen is a number on a rounded plate.
# Labels are drawn as if a little nearer to the eye, so that a slanted surface doesn't cut them.
SHADER_LINES = {
    "float scale = aParams.y;": "float scale = abs(aParams.y); vPlate = aParams.x; vDark = step(aParams.y, 0.0); vBox = position.xy * aRect.zw; vSize = aRect.zw;",
    "gl_Position = projectionMatrix * viewMatrix * vec4(worldPos, 1.0);": (
        "gl_Position = projectionMatrix * viewMatrix * vec4(worldPos, 1.0);"
        "vec4 nearer = projectionMatrix * viewMatrix * vec4(mix(worldPos, cameraPosition, 0.04), 1.0);"
        "gl_Position.z = nearer.z / nearer.w * gl_Position.w;"
    ),
    "gl_FragColor = vec4(0.0, 0.0, 0.0, a);": "gl_FragColor = vec4(mix(mix(LETTER_LIGHT, LETTER_DARK, vDark), PLATE_INK, vPlate), a);",
    "gl_FragColor = vec4(1.0, 1.0, 1.0, 0.85 * vAlpha);": (
        "float corner = 0.24 * vSize.y; vec2 outside = abs(vBox - 0.5 * vSize) - 0.5 * vSize + corner;"
        "float edge = length(max(outside, 0.0)) - corner; float soft = max(fwidth(edge), 1e-4);"
        "float shape = clamp(0.5 - edge / soft, 0.0, 1.0) * vPlate * vAlpha; if (shape < 0.004) discard;"
        "gl_FragColor = vec4(1.0, 1.0, 1.0, shape);"
    ),
}
VARYING, DECLARED = "varying float vAlpha;", "varying float vAlpha; varying float vPlate; varying float vDark; varying vec2 vBox; varying vec2 vSize;"
TONE_MAPPING = "gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );"  # it would grey the palette

# 1. viser reconnects only while the document has the focus, which a frame rarely has. 2. `darkMode` is only the theme of the
# first frame; left in place it would outvote a later change. 3. The shaders above.
SCRIPT = """
document.hasFocus = () => !document.hidden;
document.addEventListener("visibilitychange", () => dispatchEvent(new Event("focus")));
{
  const address = new URL(location.href);
  if (address.searchParams.has("darkMode")) {
    document.documentElement.dataset.mantineColorScheme = "dark";
    address.searchParams.delete("darkMode");
    history.replaceState(null, "", address.href.replace(/=(?=&|$)/g, ""));
  }
  const lines = %s;
  const take = WebGL2RenderingContext.prototype.shaderSource;
  WebGL2RenderingContext.prototype.shaderSource = function (shader, text) {
    if (text.includes("uLabelData") || text.includes(lines[2][0]) || text.includes(lines[3][0]))
      for (const [old, ours] of lines) text = text.replace(old, ours);
    take.call(this, shader, text.replace(%s, ""));
  };
}
"""


@lru_cache(maxsize=1)
def viewer_page() -> tuple[bytes, bytes]:
    """The page, plain and compressed."""
    page = installed_page().read_bytes()
    if page.count(b"<head>") != 1:
        raise RuntimeError("viser's page changed: expected exactly one <head>")
    page = page.replace(b"<head>", f"<head><script>{_script()}</script><style>{_style()}</style>".encode(), 1)
    return page, gzip.compress(page, 6)


def installed_page() -> Path:
    return Path(viser.__file__).parent / "client" / "build" / "index.html"


def _script() -> str:
    inks = {"LETTER_LIGHT": LIGHT.label_ink, "LETTER_DARK": DARK.label_ink, "PLATE_INK": "#171a1c"}
    lines = [*SHADER_LINES.items(), (VARYING, DECLARED)]
    for name, ink in inks.items():
        vector = "vec3(" + ", ".join(f"{channel / 255:.4f}" for channel in rgb(ink)) + ")"
        lines = [(old, ours.replace(name, vector)) for old, ours in lines]
    return SCRIPT % ([list(line) for line in lines], repr(TONE_MAPPING))


def _style() -> str:
    def ground(theme: Theme) -> str:
        return f"background: linear-gradient({theme.scene_top}, {theme.scene_bottom})"

    return f"""
html {{ {ground(LIGHT)}; }}
html[data-mantine-color-scheme="dark"] {{ {ground(DARK)}; }}
body, #root, #root div:has(canvas) {{ background: none !important; }}
"""
