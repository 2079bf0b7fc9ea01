"""The two kinds of question an expert is asked, before anything is stored."""

import hashlib
from dataclasses import dataclass

Sequence = tuple[int, ...]


@dataclass(frozen=True)
class SimilarityQuestion:
    """Algorithm 1: is the candidate just as good as the demonstrated sequence?"""

    demonstration: int  # index into the run's demonstrations
    candidate: Sequence
    why: str  # one sentence for the expert
    differs: Sequence  # regions that come at another step
    fingerprint: str


@dataclass(frozen=True)
class PreferenceQuestion:
    """Algorithm 2: which of two equivalent sequences is less effort?"""

    demonstration: int
    left: Sequence
    right: Sequence
    why: str
    differs: Sequence
    fingerprint: str


def differing_regions(left: Sequence, right: Sequence) -> Sequence:
    """Regions of `left`, in its order, that `right` has at another step."""
    return tuple(a for a, b in zip(left, right, strict=True) if a != b)


def appearance(left: Sequence, right: Sequence) -> tuple[int, ...]:
    """What a person sees of the difference: where `right` first departs and to what, where it ends, how much has moved.

    Two questions about one demonstration with the same appearance read the same.
    """
    step = next((k for k, (a, b) in enumerate(zip(left, right, strict=True)) if a != b), len(left))
    return (step, *right[step : step + 1], *right[-1:], len(differing_regions(left, right)))


def fingerprint(kind: str, demonstration: int, left: Sequence, right: Sequence) -> str:
    """The same question has the same fingerprint in every process."""
    text = f"{kind}|{demonstration}|{','.join(map(str, left))}|{','.join(map(str, right))}"
    return hashlib.sha256(text.encode()).hexdigest()[:24]
