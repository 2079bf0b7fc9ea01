"""Every error a person can cause or should read.

    AppError(message)            says what was wrong and what would be accepted
      InvalidInput      422      UnreadableMesh, IncompleteSequence, UnknownFeature, MalformedTable, TooLarge (413),
                                 ContradictoryConstraints, InvalidFeature
      NotFound          404
      Conflict          409      AlreadyAnswered, RunActive, StalePolicy, StaleVersion (412)
      LearningFailed             NotConverged, ContradictoryAnswers, EmptySample
      RobotFailed                Unreachable, InCollision

The core raises these and knows no HTTP; `api/errors.py` maps them. Anything else that escapes is our own bug.
"""


class AppError(Exception):
    """Root of the tree; the message is shown to people as it is."""


class InvalidInput(AppError):
    """The input can't be used; the message says what would be accepted."""


class UnreadableMesh(InvalidInput):
    """A CAD or mesh file that can't be turned into a clean surface."""


class MalformedTable(InvalidInput):
    """A region table with faults; names row and value."""


class IncompleteSequence(InvalidInput):
    """A sequence that misses or repeats regions."""


class UnknownFeature(InvalidInput):
    """A feature or interaction that the feature set does not have."""


class InvalidFeature(InvalidInput):
    """A feature of one's own that can't be read or breaks the contract every feature keeps to."""


class ContradictoryConstraints(InvalidInput):
    """Wishes about an order that can't hold together; names the smallest set of them."""


class TooLarge(InvalidInput):
    """An upload above the size limit."""


class NotFound(AppError):
    """Nothing has this id, or it was deleted."""


class Conflict(AppError):
    """The request is well-formed but what it is about has moved on."""


class AlreadyAnswered(Conflict):
    """The question was closed by an earlier answer."""


class RunActive(Conflict):
    """Something is being trained or computed that this action would pull the ground from under."""


class StalePolicy(Conflict):
    """The policy belongs to another feature set or version."""


class StaleVersion(Conflict):
    """If-Match named an older version."""


class LearningFailed(AppError):
    """A learner stopped without a policy."""


class NotConverged(LearningFailed):
    """The iteration limit was reached first."""


class ContradictoryAnswers(LearningFailed):
    """No weights agree with all answers."""


class EmptySample(LearningFailed):
    """A demonstration has no sampled sequence to compare with."""


class RobotFailed(AppError):
    """The robot can't do the plan."""


class Unreachable(RobotFailed):
    """A waypoint outside the arm's reach or joint limits."""


class InCollision(RobotFailed):
    """A link would touch the tool or the arm itself."""
