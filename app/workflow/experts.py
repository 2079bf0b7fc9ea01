"""Experts side by side: where their orders agree, where they differ, and whether they can be pooled."""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

from sqlmodel import Session

from app.geometry.tool import Tool
from app.learning.differences import Who, describe_difference
from app.learning.experts import ExpertComparison, compare_experts, extra_cost
from app.learning.performance_state import LearningDemonstration
from app.learning.questions import Sequence, differing_regions
from app.sequencing.comparison import kendall_tau
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem, check_sequence
from app.storage.tables import Demonstration, Project, Segmentation, ToolRow
from app.workflow.authors import by_expert, called, expert_key
from app.workflow.consistency import recorded_again
from app.workflow.context import Context
from app.workflow.feature_choice import project_features
from app.workflow.lookup import current_segmentation, found, present, ready_segmentation, standing, tools_of
from app.workflow.tool_picture import picture
from app.workflow.values import Values, interactions_from

Json = dict[str, Any]

SAME = 1e-7  # relative: orders that cost an expert no more than this beside their own are just as good
NOTHING: Json = {"experts": [], "pairs": [], "tools": [], "pooling": {"safe": None, "text": "", "clash": []}}


@dataclass(frozen=True)
class Place:
    """A tool that can be compared."""

    id: str
    name: str
    tool: Tool
    problem: SequencingProblem


@dataclass(frozen=True)
class Expert:
    """One expert's orders that count."""

    name: str
    own: bool
    orders: dict[int, Sequence]  # place -> order
    rows: tuple[str, ...]  # ids of the demonstrations
    again: Json


def experts(ctx: Context, project_id: str) -> Json:
    """Who has recorded what; with two or more experts, a comparison of each two and of all together."""
    places, shown, key = ctx.store.read(lambda session: _gathered(ctx.values, session, project_id))
    if len(shown) < 2:
        return {**NOTHING, "experts": [_expert_json(e, places, None) for e in shown]}
    learned = ctx.values.comparisons.get(key, lambda: _learned(places, shown))
    pairs = list(combinations(range(len(shown)), 2))
    rows = [row for a, b in pairs for row in _recorded_rows(places, shown, a, b, learned)]
    if learned and not learned.pooled.realisable:
        rows += _expected_rows(places, shown, learned)
    alone = learned.certificates if learned else [None] * len(shown)
    return {
        "experts": [_expert_json(e, places, c.realisable if c else None) for e, c in zip(shown, alone, strict=True)],
        "pairs": [_pair_json(shown, a, b, rows, learned) for a, b in pairs],
        "tools": sorted(rows, key=lambda r: (not r["recorded"], r["agreement"])),
        "pooling": _pooling(places, shown, learned),
    }


def tool_picture(ctx: Context, tool_id: str, sequence: list[int], beside: list[int] | None) -> str:
    """The tool as SVG with its regions numbered in an order; those that come at another step in `beside` have a thick ring.

    Raises:
        IncompleteSequence: One of the orders misses or repeats regions.
    """

    def query(session: Session) -> str:
        row = present(session, ToolRow, tool_id)
        tool = ctx.values.tool(session, ready_segmentation(session, row))
        order = check_sequence(sequence, tool.n)
        other = check_sequence(beside, tool.n) if beside else order
        return picture(tool, order, differing_regions(tuple(order), tuple(other)), f"{row.name} in the order of work")

    return ctx.store.read(query)


def _gathered(values: Values, session: Session, project_id: str) -> tuple[list[Place], list[Expert], Any]:
    """What is compared: orders on tools that share the features of the first one, as a run would take them."""
    project = present(session, Project, project_id)
    rows = standing(session, project_id)
    if not rows:
        return [], [], None
    base = found(session, Segmentation, rows[0].segmentation_id, "segmentation").feature_set
    interactions, features = interactions_from(project.interactions), project_features(session, project_id, base)
    cuts = [(tool, current_segmentation(session, tool.id)) for tool in tools_of(session, project_id)]
    alike = [(tool, cut) for tool, cut in cuts if cut is not None and cut.feature_set == base]
    places = [Place(t.id, t.name, values.tool(session, cut), values.problem(session, cut, interactions, features)) for t, cut in alike]
    at = {place.id: k for k, place in enumerate(places)}
    found_experts = [_expert(session, orders, at) for orders in by_expert(d for d in rows if d.tool_id in at).values()]
    key = (tuple(cut.id for _, cut in alike), tuple(tuple(e.orders.items()) for e in found_experts), interactions, features.name)
    return places, found_experts, key


def _expert(session: Session, rows: list[Demonstration], at: dict[str, int]) -> Expert:
    orders = {at[d.tool_id]: tuple(d.sequence) for d in rows}
    return Expert(called(rows), not expert_key(rows[0].author), orders, tuple(d.id for d in rows), recorded_again(session, rows))


def _learned(places: list[Place], shown: list[Expert]) -> ExpertComparison | None:
    """What each one's orders teach apart and together; None where a tool is too large to be tried while somebody waits."""
    if any(places[k].problem.n > TENSOR_LIMIT for e in shown for k in e.orders):
        return None
    taught = {str(i): [LearningDemonstration(places[k].problem, s) for k, s in e.orders.items()] for i, e in enumerate(shown)}
    return compare_experts(taught, [p.problem for p in places if p.problem.n <= TENSOR_LIMIT])


def _recorded_rows(places: list[Place], shown: list[Expert], a: int, b: int, learned: ExpertComparison | None) -> list[Json]:
    both = [k for k in shown[a].orders if k in shown[b].orders]
    return [_row(places[k], shown, a, b, (shown[a].orders[k], shown[b].orders[k]), learned, recorded=True) for k in both]


def _expected_rows(places: list[Place], shown: list[Expert], learned: ExpertComparison) -> list[Json]:
    """Tools that not both have recorded, where what each taught leads to orders that differ noticeably."""
    small = [p for p in places if p.problem.n <= TENSOR_LIMIT]
    rows = []
    for d in learned.disagreements:
        a, b, place = int(d.first), int(d.second), small[d.tool]
        k = places.index(place)
        if not (k in shown[a].orders and k in shown[b].orders):
            orders = tuple(shown[e].orders.get(k, learned.chosen[d.tool][e]) for e in (a, b))
            rows.append(_row(place, shown, a, b, (orders[0], orders[1]), learned, recorded=False))
    return rows


def _row(
    place: Place,
    shown: list[Expert],
    a: int,
    b: int,
    orders: tuple[Sequence, Sequence],
    learned: ExpertComparison | None,
    *,
    recorded: bool,
) -> Json:
    left, right = orders
    names, descriptions = [r.name for r in place.tool.regions], [r.description for r in place.tool.regions]
    who = Who(shown[a].name, shown[b].name, f"{shown[b].name} works in the order of {shown[a].name} backwards")
    weights = [learned.certificates[e].weights for e in (a, b)] if learned else None
    extra = extra_cost(place.problem, weights[0], weights[1], left, right) if weights else None
    return {
        "tool_id": place.id,
        "tool_name": place.name,
        "recorded": recorded,
        "first": {"author": shown[a].name, "sequence": list(left)},
        "second": {"author": shown[b].name, "sequence": list(right)},
        "agreement": kendall_tau(left, right),
        "just_as_good": True if left == right else None if extra is None else extra <= SAME,
        "extra": extra,
        "differs": list(differing_regions(left, right)),
        "text": describe_difference(names, descriptions, left, right, who),
    }


def _pair_json(shown: list[Expert], a: int, b: int, rows: list[Json], learned: ExpertComparison | None) -> Json:
    names = shown[a].name, shown[b].name
    both = [r for r in rows if r["recorded"] and (r["first"]["author"], r["second"]["author"]) == names]
    mean = sum(r["agreement"] for r in both) / len(both) if both else None
    same, good = sum(not r["differs"] for r in both), sum(bool(r["differs"]) and bool(r["just_as_good"]) for r in both)
    return {
        "first": names[0],
        "second": names[1],
        "tools": len(both),
        "same": same,
        "just_as_good": good,
        "agreement": mean,
        "expected_agreement": float(learned.likeness[a, b]) if learned else None,
        "text": _pair_words(names, len(both), same, good, mean),
    }


def _pair_words(names: tuple[str, str], count: int, same: int, good: int, mean: float | None) -> str:
    who = f"{names[0]} and {names[1]}"
    if mean is None:
        return f"{who} have recorded no tool in common."
    parts = [f"{same} in the same order"] * bool(same)
    parts += [f"{good} in another order that is just as good to both"] * bool(good)
    parts += [f"{count - same - good} in orders that differ"] * bool(count - same - good)
    tools = "1 tool" if count == 1 else f"{count} tools"
    return f"{who} have both recorded {tools}: {', '.join(parts)} (agreement {mean:.2f}, where 1 is the same order)."


def _expert_json(expert: Expert, places: list[Place], explained: bool | None) -> Json:
    return {
        "name": expert.name,
        "own": expert.own,
        "demonstrations": list(expert.rows),
        "tools": [places[k].id for k in expert.orders],
        "explained": explained,
        **expert.again,
    }


def _pooling(places: list[Place], shown: list[Expert], learned: ExpertComparison | None) -> Json:
    """Whether one set of weights explains everybody's orders, and if not, the smallest set that shows why."""
    if learned is None:
        return {
            "safe": None,
            "text": "These tools are too large to try it beforehand; a run on all orders tells whether they agree.",
            "clash": [],
        }
    everyone = [(e, k) for e in shown for k in e.orders]
    if learned.pooled.realisable:
        text = f"One set of weights explains all {len(everyone)} orders of {_list([e.name for e in shown])}, so they can be pooled."
        return {"safe": True, "text": text, "clash": []}
    clash = [everyone[i] for i in learned.clash]
    told = [{"tool_id": places[k].id, "tool_name": places[k].name, "author": e.name} for e, k in clash]
    orders = _list([f"{c['tool_name']} by {c['author']}" for c in told])
    if len(told) == 1:
        text = f"No weights make {orders} the best order, not even alone. Record it again, or learn from the others."
    elif len({e.name for e, _ in clash}) == 1:
        text = f"{orders} exclude each other, although they are one expert's. Record one again, or learn from the others."
    else:
        why = f"{orders} exclude each other."
        text = f"No weights explain everybody's orders, so learn from one expert at a time; pooled, they give a compromise. {why}"
    return {"safe": False, "text": text, "clash": told}


def _list(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
