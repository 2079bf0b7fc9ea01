"""`apprentice bench sequencing`: seconds of the exact sequencing per number of regions."""

import time
from collections.abc import Iterator

import numpy as np

from app.benches.figures import Figure, Options
from app.geometry.moulds import sample_moulds
from app.geometry.regions import measure as measured
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence


def measure(options: Options) -> Iterator[Figure]:
    """Solve times on the sample moulds."""
    for mould in sample_moulds()[: 2 if options.quick else None]:
        problem = problem_for(measured(mould.mesh, mould.labels).graph)
        w = np.ones(len(problem.columns))
        shortest_sequence(problem, w)
        start = time.process_time()
        for _ in range(10):
            shortest_sequence(problem, w)
        yield Figure("exact", f"N = {problem.n}, {mould.name}", (time.process_time() - start) * 100, "ms")
