"""How two sequences of one tool differ, in a sentence."""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

from app.learning.questions import Sequence, differing_regions

EARLY = ("first", "second", "third", "fourth", "fifth")


@dataclass(frozen=True)
class Who:
    """What the two orders are called."""

    first: str  # at the start of a sentence
    second: str  # inside one
    backwards: str


YOURS = Who("Yours", "the other", "The other is your order backwards")
PAIR = Who("The left order", "the right one", "The right order is the left one backwards")


def describe_difference(names: Ordered[str], descriptions: Ordered[str], left: Sequence, right: Sequence, who: Who = YOURS) -> str:
    """'Yours does A (floor) before C (left wall); the other starts with C (left wall).'

    Args:
        names: Region names by region id.
        descriptions: Region descriptions by region id; empty where there is none.
        left: The recorded sequence, or the one shown on the left.
        right: The other one.
        who: What they are called.
    """
    differs = differing_regions(left, right)
    if not differs:
        return "Both orders are the same."
    step = next(k for k in range(len(left)) if left[k] != right[k])
    ours, theirs = left[step], right[step]
    called = [_called(names[a], descriptions[a]) for a in range(len(names))]
    if left == right[::-1]:
        return f"{who.backwards}: it starts with {called[theirs]} and ends with {called[right[-1]]}."
    before = f"{who.first} does {called[ours]} before {called[theirs]}"
    if step == 0:
        after = f"{who.second} starts with {called[theirs]}"
    elif step < len(EARLY):
        after = f"{who.second} does {called[theirs]} {EARLY[step]}"
    else:
        after = f"{who.second} does {called[theirs]} as step {step + 1}"
    if len(differs) == 2 and abs(left.index(ours) - left.index(theirs)) == 1:
        return f"{before}, {who.second} the reverse; all else is the same."
    end = f" and ends with {called[right[-1]]}" if left[-1] != right[-1] and right[-1] != theirs else ""
    return f"{before}; {after}{end}. {_moved(len(differs), len(left))}"


def regions_to_mark(left: Sequence, right: Sequence) -> tuple[int, ...]:
    """Where to look: the regions at another step, or where these are more than half of all only those that the sentence names."""
    differs = differing_regions(left, right)
    if 2 * len(differs) <= len(left):
        return differs
    step = next(k for k in range(len(left)) if left[k] != right[k])
    ends = (right[-1],) if left[-1] != right[-1] else ()
    return tuple(dict.fromkeys((left[step], right[step], *ends)))


def _called(name: str, description: str) -> str:
    words = description.strip()
    if not words or words.lower() == name.lower():
        return name
    keep = len(words) > 1 and words[:2].isupper()
    return f"{name} ({words if keep else words[0].lower() + words[1:]})"


def _moved(differing: int, total: int) -> str:
    return f"{'All' if differing == total else f'{differing} of'} {total} regions come at another step."
