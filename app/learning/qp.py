"""The one door to the quadratic-program solver."""

from dataclasses import dataclass

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from app.errors import NotConverged

Array = NDArray[np.float64]

ACCURACY = 1e-11  # gap and feasibility; costs are compared at 1e-7 relative, so the solver must be far below


@dataclass(frozen=True)
class QuadraticProgram:
    """Minimise 1/2 x'diag(curvature)x + slope'x subject to rows x <= limits."""

    curvature: Array  # (k,) diagonal, >= 0
    slope: Array  # (k,)
    rows: Array  # (r, k)
    limits: Array  # (r,)


def solve(program: QuadraticProgram) -> Array:
    """The minimiser, shape (k,).

    Raises:
        NotConverged: The solver gave up, which for these always feasible soft programs means badly scaled input.
    """
    settings = clarabel.DefaultSettings()  # pyright: ignore[reportAttributeAccessIssue]
    settings.verbose = False
    settings.max_threads = 1  # same bits on every machine size
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = ACCURACY
    answer = clarabel.DefaultSolver(  # pyright: ignore[reportAttributeAccessIssue]
        sparse.diags_array(program.curvature, format="csc"),
        program.slope,
        sparse.csc_array(program.rows),
        program.limits,
        [clarabel.NonnegativeConeT(len(program.limits))],  # pyright: ignore[reportAttributeAccessIssue]
        settings,
    ).solve()
    if str(answer.status) not in ("Solved", "AlmostSolved"):
        raise NotConverged(f"The weights could not be computed (solver says {answer.status}). Check the tools for extreme feature values.")
    return np.asarray(answer.x)
