"""Situations and what to do about them in plain words."""

from app.sequencing.features import FeatureSet, factor_label

LEVEL_WORDS = ("small", "middle", "large")
PHRASES = {"height": "step in height", "curvature": "change of curvature", "orientation": "turn towards neighbours"}
SHAPES = {  # of a region, when its turn comes: what makes the factor small, middle, large
    "height": (
        "about as high as what is finished",
        "somewhat higher or lower than what is finished",
        "far above or below what is finished",
    ),
    "curvature": (
        "curved like what is finished",
        "curved somewhat differently from what is finished",
        "curved quite differently from what is finished",
    ),
    "jump": ("right beside a finished region", "beside a finished region only at a corner", "apart from all finished regions"),
}

Tools = tuple[tuple[int, tuple[int, ...]], ...]  # tool, regions


def phrase(key: str, features: FeatureSet) -> str:
    """'step in height'; refuses an unknown factor."""
    label = factor_label(key, features)
    return PHRASES.get(key, label)


def situation(first: str, second: str, cell: int) -> str:
    """'a large step in height with a small change of curvature'."""
    row, column = divmod(cell, 3)
    return f"a {LEVEL_WORDS[row]} {first} with a {LEVEL_WORDS[column]} {second}"


def advice(state: str, text: str, tools: Tools, waiting: list[int], alike: str) -> str:
    """What to do about a situation; empty when it is covered or on no tool. `alike` says what its steps have too much in common."""
    if state in ("captured", "impossible"):
        return ""
    fresh = sum(i in waiting for i, _ in tools)
    need = f"No demonstration shows {text}" if state == "missing" else f"The steps shown are too much alike for {text}{alike}"
    if not fresh:
        return f"{need}. Only tools that already have a demonstration have it: record another order there, or add a tool."
    return f"{need}; {fresh} tool{'' if fresh == 1 else 's'} without a demonstration {'has' if fresh == 1 else 'have'} it."


def alike_words(label: str, level: int) -> str:
    """What uneven steps have in common: ': jump is mostly small'."""
    return f": {label} is mostly {LEVEL_WORDS[level]}"


def shape_needed(keys: tuple[str, str], labels: tuple[str, str], cell: int) -> str:
    """What a tool needs to have a situation."""
    parts = [
        SHAPES[key][level] if key in SHAPES else f"met with a {LEVEL_WORDS[level]} {label}"
        for key, label, level in zip(keys, labels, divmod(cell, 3), strict=True)
    ]
    return f"A new tool needs a region that is, when its turn comes, {parts[0]} and {parts[1]}."


def listed(names: list[str]) -> str:
    """'A, B and C'."""
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else "".join(names)
