"""Whose order is it? Orders of several experts are kept apart by the name they were recorded under.

Who has no reason to give a name needn't: orders without one, and those that came with a region table or the sample, are the
project's own expert's, so that with a single expert everything counts as one.
"""

from collections.abc import Iterable

from app.errors import InvalidInput
from app.storage.tables import Demonstration

NO_NAME = "No name"
OWN = frozenset({"", NO_NAME.casefold(), "expert", "scripted expert"})  # names that tables and the sample give
LONGEST = 120


def tidy_author(author: str | None) -> str | None:
    """A name as it is stored; None for none.

    Raises:
        InvalidInput: It is too long.
    """
    name = " ".join((author or "").split())
    if len(name) > LONGEST:
        raise InvalidInput(f"A name has at most {LONGEST} characters, not {len(name)}.")
    return name or None


def expert_key(author: str | None) -> str:
    """The same for every spelling of a name; empty for the project's own expert."""
    key = " ".join((author or "").split()).casefold()
    return "" if key in OWN else key


def shown_name(author: str | None) -> str:
    """What an author is called on the pages."""
    return author or NO_NAME


def by_expert(rows: Iterable[Demonstration]) -> dict[str, list[Demonstration]]:
    """Demonstrations by the key of their expert; the project's own first, then by name."""
    found: dict[str, list[Demonstration]] = {}
    for row in rows:
        found.setdefault(expert_key(row.author), []).append(row)
    return dict(sorted(found.items()))


def called(rows: list[Demonstration]) -> str:
    """The name of the expert of some demonstrations, as the newest one that has a name spells it."""
    return shown_name(next((row.author for row in sorted(rows, key=lambda r: r.id, reverse=True) if row.author), None))


def orders_by(rows: list[Demonstration], names: list[str]) -> tuple[list[str], list[Demonstration]]:
    """The orders of the named experts, of all of them if none is named, and what they are called; no names where there is one expert.

    Raises:
        InvalidInput: Nobody of that name has recorded an order that counts.
    """
    experts = by_expert(rows)
    wanted = {expert_key(name) for name in names} or set(experts)
    unknown = [name for name in names if expert_key(name) not in experts]
    if unknown:
        known = ", ".join(called(orders) for orders in experts.values())
        raise InvalidInput(f"There is no order by {unknown[0]} to learn from. Experts with orders are: {known or 'none'}.")
    shown = [called(orders) for key, orders in experts.items() if key in wanted]
    return shown if len(experts) > 1 else [], [row for row in rows if expert_key(row.author) in wanted]
