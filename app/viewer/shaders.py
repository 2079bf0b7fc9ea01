"""What our page changes in viser's shaders while the browser compiles them: labels, lines and the tone of colours.

viser has one look for labels (black on a see-through white box), lets thick lines cut into each other, and greys all colours.
Each entry replaces one line of a shader's text; where a line is not found the shader stays as viser wrote it, and
tests/viewer/test_page.py, which reads viser's sources, fails.
"""

from dataclasses import dataclass

from app.viewer.palette import DARK, LIGHT, rgb

PLATE_INK = "#171a1c"


@dataclass(frozen=True)
class Change:
    """Replace `old` by `new` in shaders that contain `mark`."""

    mark: str
    old: str
    new: str


def vector(colour: str) -> str:
    """A colour as GLSL writes it."""
    return "vec3(" + ", ".join(f"{channel / 255:.4f}" for channel in rgb(colour)) + ")"


# A label sized in the scene (aParams.x = 0) is a letter without a plate; the sign of its height chooses the ink of the theme.
# One sized on the screen is a bold number on a rounded white plate. Both are drawn as if 4 % nearer to the eye, so that a
# slanted surface does not cut them. Plates have no texture coordinates, which tells them from glyphs.
LABEL = "aLabelIndex"
LABELS = (
    Change(
        "vAlpha",
        "varying float vAlpha;",
        "varying float vAlpha; varying float vPlate; varying float vDark; varying vec2 vBox; varying vec2 vSize;",
    ),
    Change(LABEL, "float scale = aParams.y;", "float scale = abs(aParams.y); vPlate = aParams.x; vDark = step(aParams.y, 0.0);"),
    Change(
        LABEL,
        "vec2 local = (aRect.xy + corner * aRect.zw) * scale;",
        "vec4 box = aRect; if (aUvRect.z <= aUvRect.x) { vec2 grown = vec2(max(aRect.z + 0.42 * aRect.w, 1.08 * aRect.w), 1.08 * aRect.w);"
        " box.xy += 0.5 * (aRect.zw - grown); box.zw = grown; }"
        " vSize = box.zw; vBox = corner * vSize; vec2 local = (box.xy + vBox) * scale;",
    ),
    Change(
        LABEL,
        "gl_Position = projectionMatrix * viewMatrix * vec4(worldPos, 1.0);",
        "gl_Position = projectionMatrix * viewMatrix * vec4(worldPos, 1.0);"
        " vec4 nearer = projectionMatrix * viewMatrix * vec4(mix(worldPos, cameraPosition, 0.04), 1.0);"
        " gl_Position.z = nearer.z / nearer.w * gl_Position.w;",
    ),
    Change("uAtlas", "float a = smoothstep(-aa, aa, distPx) * vAlpha;", "float a = smoothstep(-aa, aa, distPx + 0.75 * vPlate) * vAlpha;"),
    Change(
        "uAtlas",
        "gl_FragColor = vec4(0.0, 0.0, 0.0, a);",
        f"gl_FragColor = vec4(mix(mix({vector(LIGHT.label_ink)}, {vector(DARK.label_ink)}, vDark), {vector(PLATE_INK)}, vPlate), a);",
    ),
    Change(
        "vAlpha",
        "gl_FragColor = vec4(1.0, 1.0, 1.0, 0.85 * vAlpha);",
        "float round = 0.22 * vSize.y; vec2 outside = abs(vBox - 0.5 * vSize) - 0.5 * vSize + round;"
        " float edge = length(max(outside, 0.0)) - round;"
        " float shape = clamp(0.5 - edge / max(fwidth(edge), 1e-4), 0.0, 1.0) * vPlate * vAlpha; if (shape < 0.004) discard;"
        " gl_FragColor = vec4(1.0, 1.0, 1.0, shape);",
    ),
)
# Lines are drawn a little nearer to the eye than the surface they lie on: borders, then outlines above their casing. The shares
# outweigh the slant of the surface across the width of a line.
LINES = (
    Change(
        "instanceStart",
        "gl_Position = clip;",
        "float lift = linewidth > 6.0 ? 0.004 : linewidth > 3.0 ? 0.014 : 0.006;"
        " vec4 nearer = projectionMatrix * vec4((position.y < 0.5 ? start : end).xyz * (1.0 - lift), 1.0);"
        " clip.z = nearer.z / nearer.w * clip.w; gl_Position = clip;",
    ),
)
COLOURS = (Change("toneMapping", "gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );", ""),)
CHANGES = (*LABELS, *LINES, *COLOURS)
