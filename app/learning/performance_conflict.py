"""Which demonstrations stand against each other when no weights explain all of them, and how that is said."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

Members = tuple[int, ...]

LISTED = 5  # more names than this are counted instead


@dataclass(frozen=True)
class Contradiction:
    """Demonstrations that can't all be the cheapest under the same weights."""

    odd: Members  # without these the rest can be explained; where it isn't clear which, all that come into question
    clear: bool  # leaving out any other one doesn't help
    alone: bool  # clear, and not even on its own can it be the cheapest
    rest: bool  # there are other demonstrations


def find_contradiction(count: int, fits: Callable[[Members], float]) -> Contradiction | None:
    """The demonstrations to blame, None when all fit together.

    Args:
        count: Number of demonstrations.
        fits: What is left unexplained of some demonstrations by the weights best for them; 0 when nothing is.
    """
    everyone = tuple(range(count))
    if fits(everyone) == 0:
        return None
    if count == 1:
        return Contradiction(everyone, clear=True, alone=True, rest=False)
    odd: Members = ()
    kept = everyone
    while len(kept) > 1:
        left = {i: fits(tuple(k for k in kept if k != i)) for i in kept}
        if not odd and min(left.values()) == 0:
            odd = tuple(i for i in kept if left[i] == 0)
            clear = len(odd) == 1
            return Contradiction(odd, clear, alone=clear and fits(odd) > 0, rest=len(odd) < count)
        worst = min(kept, key=lambda i: left[i])
        odd, kept = (*odd, worst), tuple(k for k in kept if k != worst)
        if left[worst] == 0:
            break
    for i in odd[:-1]:  # taken out on the way, though it may fit to those that were left in the end
        together = tuple(sorted((*kept, i)))
        if fits(together) == 0:
            kept = together
    return Contradiction(tuple(i for i in everyone if i not in kept), clear=True, alone=False, rest=True)


def contradiction_words(found: Contradiction, names: Sequence[str]) -> str:
    """What is wrong and what can be done.

    Args:
        found: The contradiction.
        names: What each demonstration is called, by its index; once as "demonstration 3", once as its tool's name.
    """
    odd = _list([names[i] for i in found.odd], "and")
    others = [names[i] for i in range(len(names)) if i not in found.odd]
    either = _list([names[i] for i in found.odd], "or")
    if not found.clear:
        who = f"{odd} contradict each other: no weights make all these orders the best ones"
        rest = f", but without one of them everything fits. Record {either} again, or use the best compromise between them."
        return _sentence(who + rest)
    many = len(found.odd) > 1
    if found.alone:
        whose = "the order recorded for it" if not many else "the orders recorded for them"
        why = f"{odd} can't be explained: no weights make {whose} the best one, not even alone"
    else:
        all_others = _list(others, "and") if len(others) <= LISTED else f"the other {len(others)}"
        why = f"{odd} {'contradict' if many else 'contradicts'} {all_others}: no weights explain all of them together"
    if not found.rest:
        return _sentence(f"{why}. Record {odd} again, or use the best compromise.")
    agree = "The others agree with each other. " if len(others) > 1 else ""
    return _sentence(
        f"{why}. {agree}Record {odd} again, or use the best compromise, which follows {'the others' if len(others) > 1 else others[0]}."
    )


def _list(names: list[str], word: str) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {word} {names[-1]}"


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]
