"""The same sequencing cost as a domain-independent dynamic program, for the solver didppy (group `bench`): a yardstick, not the product.

Only for tools whose regions form a grid in plan view, where a bounding box is a range of rows and columns.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# didppy is a compiled module without type information.

from typing import Any

import didppy as dp
import numpy as np

from app.geometry.tool import Array
from app.sequencing.problem import SequencingProblem
from app.sequencing.transitions import CLEAN, REAL, Model, box_area, model_of


def solve(problem: SequencingProblem, w: Array, seconds: float) -> tuple[tuple[int, ...], bool, list[tuple[float, float]]]:
    """Complete anytime beam search: the best order, whether it is proved, and (seconds, cost) of each better one."""
    solver = dp.CABS(_build(problem, w), time_limit=seconds, quiet=True)
    trace: list[tuple[float, float]] = []
    order, proved, done = (), False, False
    while not done:
        solution, done = solver.search_next()
        if solution.transitions:
            order, proved = tuple(int(t.name) for t in solution.transitions), solution.is_optimal
            trace.append((solution.time, float(solution.cost)))
    return order, proved, trace


def _build(problem: SequencingProblem, w: Array) -> Any:
    m = model_of(problem, w)
    if m.kind not in (CLEAN, REAL):
        raise ValueError("only the clean and the authors' real features are modelled")
    model = dp.Model(maximize=False, float_cost=True)
    regions = model.add_object_type(number=m.n)
    left = model.add_set_var(object_type=regions, target=list(range(m.n)))
    done = left.complement()
    model.add_base_case([left.is_empty()])
    count = dp.max(done.len(), 1)
    curve = model.add_float_table(m.curvature.tolist())[done] / count
    level = model.add_float_table(m.level.tolist())[done] / count
    inside, behind = _gap(model, m, regions, done), _gap(model, m, regions, left)
    for a in range(m.n):
        cost = _step(model, m, regions, a, done, curve, level, inside, behind)
        model.add_transition(
            dp.Transition(
                name=str(a), cost=cost + dp.FloatExpr.state_cost(), effects=[(left, left.remove(a))], preconditions=[left.contains(a)]
            )
        )
    return model


def _step(model: Any, m: Model, regions: Any, a: int, done: Any, curve: Any, level: Any, inside: Any, behind: Any) -> Any:
    """w . phi of region a."""

    def taken(matrix: Array) -> Any:
        return model.add_float_table(matrix[a].tolist())[done]

    def touched(row: Array) -> Any:
        mask = model.create_set_const(object_type=regions, value=np.flatnonzero(row).tolist())
        return ~(done & mask).is_empty()

    start = ~done.is_empty()
    shared, opposite = taken(m.shared), taken(m.opposite)
    edge, corner = touched(m.edge[a]), touched(m.corner[a])
    bend, fall = float(m.curvature[a]) - curve, level - float(m.height[a])
    phi = [float(m.start[a, 0]) - shared, shared, float(m.start[a, 1]) - opposite, opposite, None, inside]
    phi.append(start.if_then_else(behind, 0.0))
    if m.kind == CLEAN:
        phi[4] = start.if_then_else(edge.if_then_else(0.0, corner.if_then_else(1 / 3, 1.0)), 0.0)
        phi.append(start.if_then_else(abs(bend) / 2, abs(float(m.curvature[a]))))
    else:
        first = touched(np.arange(m.n) == m.first[a])
        phi[4] = first.if_then_else(0.0, corner.if_then_else(5.0, edge.if_then_else(0.0, 15.0)))
        phi.append(start.if_then_else(abs(bend), float(m.curvature[a])))
    phi.append(float(m.start[a, 2]) - taken(m.turn))
    if m.kind == CLEAN:
        phi += [start.if_then_else(dp.max(-fall, 0.0), 0.0), start.if_then_else(dp.max(fall, 0.0), 0.0)]
    else:
        phi.append(start.if_then_else(dp.max(-99 * fall, 21 * fall), 0.0) + float(m.inverse[a]))
    phi = [*phi, *([0.0] * (len(m.w) + 1 - len(phi)))]
    total = sum(float(weight) * x for weight, x in zip(m.w, phi, strict=False) if weight)
    for weight, (one, two) in zip(m.v, m.factors, strict=True):
        total += float(weight) * (phi[one[0]] + phi[one[1]]) * (phi[two[0]] + phi[two[1]])
    return total


def _gap(model: Any, m: Model, regions: Any, members: Any) -> Any:
    """1 - area(S) / area(box of S); 0 for at most one region."""
    bands = [np.unique(np.round(m.low[:, k], 9), return_inverse=True)[1] for k in range(2)]
    ends = [_ends(model, regions, members, band) for band in bands]
    sizes = [int(band.max()) + 1 for band in bands]
    area = np.ones((sizes[0], sizes[0], sizes[1], sizes[1]))
    for i, j, k, q in np.ndindex(area.shape):
        if i <= j and k <= q:
            low = [m.low[bands[0] == i, 0].min(), m.low[bands[1] == k, 1].min()]
            high = [m.high[bands[0] == j, 0].max(), m.high[bands[1] == q, 1].max()]
            area[i, j, k, q] = box_area(m, low[0], low[1], high[0], high[1])
    own = model.add_float_table(m.area.tolist())[members]
    table = model.add_float_table({index: float(area[index]) for index in np.ndindex(area.shape)}, default=1.0)
    box = table[ends[0][0], ends[0][1], ends[1][0], ends[1][1]]
    return (members.len() > 1).if_then_else(1 - own / box, 0.0)


def _ends(model: Any, regions: Any, members: Any, band: Any) -> tuple[Any, Any]:
    """First and last band with a member."""
    count = int(band.max()) + 1
    filled = [
        ~(members & model.create_set_const(object_type=regions, value=np.flatnonzero(band == b).tolist())).is_empty() for b in range(count)
    ]
    first, last = dp.ElementExpr(count - 1), dp.ElementExpr(0)
    for b in range(count - 1, -1, -1):
        first = filled[b].if_then_else(dp.ElementExpr(b), first)
    for b in range(count):
        last = filled[b].if_then_else(dp.ElementExpr(b), last)
    return first, last
