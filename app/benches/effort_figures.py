"""How few answers an effort preference takes, on the authors' synthetic tools."""

from collections.abc import Iterator

import numpy as np

from app.benches.figures import Figure
from app.learning.effort_study import study_effort
from app.learning.evaluation import TRAINED_ON
from app.learning.performance_state import LearningDemonstration


def effort_figures(shown: dict[int, LearningDemonstration]) -> Iterator[Figure]:
    """Every preferred side at start and end, then short ways and few changes of side."""
    group = "effort: a preferred start, end or way, authors' synthetic tools"
    trained, unseen = [[d for i, d in shown.items() if (i in TRAINED_ON["synthetic"]) is part] for part in (True, False)]
    found = study_effort(trained, unseen, np.ones(len(trained[0].problem.columns)))
    starts = [r.answers for r in found if r.preference.startswith("starts")]
    yield Figure(group, "answers until a starting side is found, most", max(starts), "", 5, "at most")
    yield Figure(group, "answers of any preference, most", max(r.answers for r in found), "", 5, "at most")
    right, tools = sum(r.unseen.after for r in found), sum(r.unseen.tools for r in found)
    missed = ", ".join(r.preference for r in found if r.unseen.after < r.unseen.tools) or "none"
    note = (
        f"before learning {sum(r.unseen.before for r in found)}; missed: {missed} (no equivalent order of a training tool starts elsewhere)"
    )
    yield Figure(group, "unseen tools done with the least effort", right, f"of {tools}", note=note if right < tools else "")
