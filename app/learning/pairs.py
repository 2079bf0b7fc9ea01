"""Which two sequences the expert should compare next, on any tool, and when there is nothing left worth asking.

The samples of the version space vote on every tool. A question shows the sequence most samples choose beside the one its
opponents choose; its worth is how much the answer is expected to lower the risk of a wrong choice on all tools together.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.learning.outlook import Outlook
from app.learning.qp import Array
from app.learning.questions import Sequence, appearance, differing_regions, fingerprint

CURIOSITY = 0.1  # worth of a nat of information beside a tool put right
TRIED = 3  # pairs per tool looked at when an answer tells a tool's class: which pair is shown then hardly matters
SHOWING = 1.0  # cost of showing an order oneself, in answers: both were wrong
TIE = 1e-12

REPEAT = "again|"  # before the fingerprint of a question that is asked a second time

Outlooks = Mapping[int, Outlook]  # tool index -> its outlook


@dataclass(frozen=True)
class PairQuestion:
    """Which of two orders of a tool would you rather do?"""

    tool: int  # index into the run's tools
    left: Sequence
    right: Sequence
    why: str  # one sentence for the expert
    differs: Sequence  # regions that come at another step
    fingerprint: str
    repeat: bool = False  # asked before; the answer tells how consistent the expert is


@dataclass(frozen=True)
class Offer:
    """A question that could be asked."""

    worth: float
    tool: int
    first: int  # class the samples prefer
    second: int  # class of those who don't


def offers(outlooks: Outlooks, asked: Mapping[int, set[tuple[int, ...]]], endorse: bool = True) -> list[Offer]:
    """Questions worth asking, the best first; at most one per tool, none where all samples agree.

    Args:
        outlooks: Tools of interest; those the expert may not be asked about are left out of the offers by the caller.
        asked: Per tool, what earlier questions looked like (`look`); none is offered twice.
        endorse: Choosing an order says "I would do it like this". Otherwise it only says "better than the other one".
    """
    found = []
    for tool, mine in outlooks.items():
        best: Offer | None = None
        tried = 0
        for first, second in _candidates(mine):
            if look(mine, first, second) in asked.get(tool, set()):
                continue
            worth = _worth_of_choice(outlooks, mine, first, second) if endorse else _worth_of_comparison(outlooks, mine, first, second)
            if best is None or worth > best.worth + TIE:
                best = Offer(worth, tool, first, second)
            tried += 1
            if endorse and tried == TRIED:
                break
        if best is not None:
            found.append(best)
    return sorted(found, key=lambda o: (-round(o.worth, 9), o.tool))


def look(mine: Outlook, first: int, second: int) -> tuple[int, ...]:
    """What a person sees of a pair, whichever side each is on."""
    return look_of(mine.sequence(first), mine.sequence(second))


def look_of(left: Sequence, right: Sequence) -> tuple[int, ...]:
    """The same from the sequences themselves."""
    return min(appearance(left, right) + left[:1], appearance(right, left) + right[:1])


def risk(outlooks: Outlooks, share: Array) -> float:
    """Expected number of tools on which the best single choice is not close to the cheapest, for weighted samples."""
    total = share.sum()
    lost = 0.0
    for mine in outlooks.values():
        here = share[: mine.close.shape[1]]
        lost += 1 - float((mine.close @ here).max()) / max(float(here.sum()), TIE) if here.any() else 0.0
    return lost if total else 0.0


def _candidates(mine: Outlook) -> list[tuple[int, int]]:
    """Pairs of classes, the most telling first: the two that most samples want, then the choice against what its opponents want."""
    count = len(mine.orders)
    votes = np.bincount(mine.favourite, minlength=count)
    against = ~mine.close[mine.chosen]
    if not against.any():
        return []
    wanted = np.bincount(mine.favourite[against], minlength=count)
    others = [int(c) for c in np.argsort(-wanted, kind="stable") if wanted[c]]
    ranked = [int(c) for c in np.argsort(-votes, kind="stable") if votes[c]]
    pairs = [tuple(ranked[:2])] if len(ranked) > 1 else []
    pairs += [(mine.chosen, c) for c in others] + [(a, b) for k, a in enumerate(ranked) for b in ranked[k + 1 :]]
    return list(dict.fromkeys((min(a, b), max(a, b)) for a, b in pairs if a != b))


def _worth_of_choice(outlooks: Outlooks, mine: Outlook, first: int, second: int) -> float:
    """Expected fall of the risk when the answer, or the expert's own order after "both wrong", tells the tool's class.

    Per answer: "both wrong" counts as two, since an order has to be shown.
    """
    count = len(mine.favourite)
    votes = np.bincount(mine.favourite, minlength=len(mine.orders)) / count
    before = risk(outlooks, np.ones(_samples(outlooks)))
    after = sum(float(votes[c]) * risk(outlooks, _share(outlooks, mine.favourite == c)) for c in np.flatnonzero(votes))
    shown = float(mine.exact[[first, second]].any(axis=0).mean())
    return (before - after + CURIOSITY * _entropy(votes)) / (1 + SHOWING * (1 - shown))


def _worth_of_comparison(outlooks: Outlooks, mine: Outlook, first: int, second: int) -> float:
    """Expected fall of the risk when the answer only tells which of the two is cheaper."""
    prefers = mine.extra[first] <= mine.extra[second]
    p = float(prefers.mean())
    if p in (0.0, 1.0):
        return -1.0
    after = p * risk(outlooks, _share(outlooks, prefers)) + (1 - p) * risk(outlooks, _share(outlooks, ~prefers))
    return risk(outlooks, np.ones(_samples(outlooks))) - after + CURIOSITY * _entropy(np.array([p, 1 - p]))


def _samples(outlooks: Outlooks) -> int:
    return max(len(o.favourite) for o in outlooks.values())


def _share(outlooks: Outlooks, mask: NDArray[np.bool_]) -> Array:
    """A mask over the samples of one tool for all samples; a tool above 14 regions looks at fewer."""
    share = np.zeros(_samples(outlooks))
    share[: len(mask)] = mask
    return share


def _entropy(p: Array) -> float:
    some = p[p > 0]
    return float(-(some * np.log(some)).sum())


def question(mine: Outlook, offer: Offer, flip: bool) -> PairQuestion:
    """The question of an offer; `flip` decides which side the chosen order is on, so that no side is always right."""
    first, second = mine.sequence(offer.first), mine.sequence(offer.second)
    left, right = (second, first) if flip else (first, second)
    shares = [float(mine.exact[c].mean()) for c in (offer.first, offer.second)]
    if min(shares) > 0.6 * max(shares):
        why = "What is known so far fits both orders about equally well; your answer decides between them."
    else:
        why = f"What is known so far leaves this open ({max(shares):.0%} against {min(shares):.0%}); your answer decides it."
    return PairQuestion(offer.tool, left, right, why, differing_regions(left, right), fingerprint("pair", offer.tool, left, right))
