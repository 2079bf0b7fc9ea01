"""The tables. Rows never leave storage and workflow; `version` counts changes (the ETag of the REST interface).

Table models don't validate (SQLModel leaves that to plain models), so the database does, by CHECK constraints.
JSON columns are replaced as a whole: a change inside one would be lost.
"""

from typing import Any

from sqlalchemy import CheckConstraint, Index, text
from sqlmodel import Field, SQLModel

from app.storage.columns import json_column, list_column, object_column, one_of, owned
from app.storage.identity import new_id, now

RUN_STATES = ("queued", "training", "waiting_for_expert", "converged", "stalled", "infeasible", "failed", "cancelled")
ACTIVE_RUN_STATES = ("queued", "training", "waiting_for_expert")
JOB_STATES = ("queued", "running", "done", "failed", "cancelled")
Json = dict[str, Any]


class Project(SQLModel, table=True):
    """Everything that belongs to one process and its expert."""

    __table_args__ = (CheckConstraint("length(name) BETWEEN 1 AND 200", name="name"),)
    id: str = Field(default_factory=new_id, primary_key=True)
    name: str
    process: str = ""
    sample: bool = False
    interactions: list[dict[str, str]] = json_column()  # [{first, second}]
    template: str | None = None  # the process template it started from: a built-in key or an id
    without: list[str] = list_column()  # factors switched off
    own: list[str] = list_column()  # own features switched on, "key@version"
    levels: Json = object_column()  # {default, chosen: {factor: rule}, expert: {factor: [low, high]}}
    version: int = 1
    created_at: str = Field(default_factory=now)
    updated_at: str = Field(default_factory=now)
    deleted_at: str | None = None


class Artifact(SQLModel, table=True):
    """A file in the content-addressed store."""

    __table_args__ = (CheckConstraint("length(sha) = 64", name="sha"), CheckConstraint("size >= 0", name="size"))
    sha: str = Field(primary_key=True)
    size: int
    media_type: str
    created_at: str = Field(default_factory=now)


class ToolRow(SQLModel, table=True):
    """A part and where its import stands."""

    __tablename__ = "tool"  # pyright: ignore[reportAssignmentType]
    __table_args__ = (
        one_of("kind", "cad", "table", "sample"),
        one_of("state", "asking", "importing", "ready", "failed"),
        one_of("split", "train", "test"),
    )
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    name: str
    kind: str
    state: str
    questions: Json | None = json_column(nullable=True)  # {units: {...} | null, up: {...} | null, body: {...} | null}
    units: str | None = None
    up: str | None = None
    body: str | None = None  # "1", "2", ... or "all" of `bodies`; None: not chosen, or there is only one
    bodies: list[Json] | None = json_column(nullable=True)  # what the file holds: [{id, name, extents, faces, up_guess}]
    file_name: str | None = None
    source_sha: str | None = owned("artifact.sha", nullable=True)  # the file as uploaded
    parsed_sha: str | None = owned("artifact.sha", nullable=True)  # its triangles and bodies, not cleaned
    part_sha: str | None = owned("artifact.sha", nullable=True)  # cleaned mesh with CAD faces
    tree_sha: str | None = owned("artifact.sha", nullable=True)  # the merge tree of that mesh
    split: str | None = None
    report: list[dict[str, str]] = json_column()  # [{level, text}]
    error: Json | None = json_column(nullable=True)  # {error, detail}
    version: int = 1
    created_at: str = Field(default_factory=now)
    deleted_at: str | None = None


class Segmentation(SQLModel, table=True):
    """One immutable cut of a tool into regions; sequences name the segmentation they were clicked on.

    Only the pointers change: `current` is where the tool stands in its history, `redo_id` where a redo leads from here.
    """

    __table_args__ = (
        CheckConstraint("region_count >= 1", name="region_count"),
        Index("uq_segmentation_current", "tool_id", unique=True, sqlite_where=text("current")),
    )
    id: str = Field(default_factory=new_id, primary_key=True)
    tool_id: str = owned("tool.id")
    params: Json = json_column()
    tool_sha: str = owned("artifact.sha")  # the Tool value
    region_count: int
    feature_set: str
    current: bool = True
    parent_id: str | None = owned("segmentation.id", nullable=True)  # the cut this one was made from by an edit
    redo_id: str | None = owned("segmentation.id", nullable=True)
    kind: str = Field(
        default="cut", sa_column_kwargs={"server_default": "cut"}
    )  # of the edit: merge, split_plane, ..., or cut for a cut by parameters
    words: str = Field(default="Read in", sa_column_kwargs={"server_default": "Read in"})  # the edit, for people: "Merged B and C"
    locked: list[int] = list_column()
    hidden: list[int] = list_column()
    created_at: str = Field(default_factory=now)


class RegionName(SQLModel, table=True):
    """A name a person gave a region."""

    __tablename__ = "region_name"  # pyright: ignore[reportAssignmentType]
    __table_args__ = (CheckConstraint("region >= 0", name="region"),)
    segmentation_id: str = Field(foreign_key="segmentation.id", primary_key=True)
    region: int = Field(primary_key=True)
    name: str


class Demonstration(SQLModel, table=True):
    """A tool with the expert's sequence."""

    __table_args__ = (one_of("source", "recorded", "table", "scripted", "rest"),)
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    tool_id: str = owned("tool.id")
    segmentation_id: str = owned("segmentation.id")
    name: str
    sequence: list[int] = json_column()
    click_times: list[float] | None = json_column(nullable=True)  # s since the first click
    author: str | None = None
    source: str
    superseded_by: str | None = owned("demonstration.id", nullable=True)
    version: int = 1
    created_at: str = Field(default_factory=now)
    deleted_at: str | None = None


class Draft(SQLModel, table=True):
    """The sequence being clicked on a tool, with its undo history."""

    tool_id: str = Field(foreign_key="tool.id", primary_key=True)
    segmentation_id: str = owned("segmentation.id")
    sequence: list[int] = json_column()
    click_times: list[float] = json_column()  # seconds since the epoch, one per region
    past: list[list[Any]] = json_column()  # [[sequence, click_times], ...]
    future: list[list[Any]] = json_column()
    updated_at: str = Field(default_factory=now)


class Run(SQLModel, table=True):
    """A learner's life."""

    __table_args__ = (
        one_of("kind", "performance", "effort", "exception"),
        one_of("mode", "certified", "paper"),
        one_of("state", *RUN_STATES),
        CheckConstraint("round >= 0 AND iteration >= 0 AND seed >= 0", name="counts"),
    )
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    kind: str
    mode: str = Field(default="paper", sa_column_kwargs={"server_default": "paper"})  # of a performance run: how it learns
    authors: list[str] = list_column()  # names of the experts it learns from, where there are several
    interest: list[str] = list_column()  # segmentations of the tools without a demonstration it may ask about, fixed at the start
    state: str = "queued"
    round: int = 0  # of questions: 0 before the first
    iteration: int = 0
    seed: int
    params: Json = json_column()
    interactions: list[dict[str, str]] = json_column()
    features: str | None = None  # name of the feature set; None on runs of earlier versions: that of the demonstrated tools
    checkpoint: int = 0  # number of the current checkpoint, 0 before the first
    based_on: str | None = None  # effort: the performance policy; exception: the policy that is doubted
    policy_id: str | None = None
    message: str = ""
    error: Json | None = json_column(nullable=True)
    version: int = 1
    created_at: str = Field(default_factory=now)
    updated_at: str = Field(default_factory=now)


class RunDemonstration(SQLModel, table=True):
    """What a run trains on, in its order; fixed when the run starts."""

    __tablename__ = "run_demonstration"  # pyright: ignore[reportAssignmentType]
    run_id: str = Field(foreign_key="run.id", primary_key=True)
    position: int = Field(primary_key=True)
    demonstration_id: str = owned("demonstration.id")
    tool_id: str = owned("tool.id")


class RunCheckpoint(SQLModel, table=True):
    """The learner's state after a step; enough to go on from there on any day."""

    __tablename__ = "run_checkpoint"  # pyright: ignore[reportAssignmentType]
    run_id: str = Field(foreign_key="run.id", primary_key=True)
    number: int = Field(primary_key=True)
    round: int
    iteration: int
    outcome: str
    state: Json = json_column()
    weights: list[float] = json_column()
    identifiable: list[bool] = json_column()
    report: Json | None = json_column(nullable=True)  # certified: what is proved, and how sure each tool is
    created_at: str = Field(default_factory=now)


class Metric(SQLModel, table=True):
    """One iteration of a run."""

    run_id: str = Field(foreign_key="run.id", primary_key=True)
    iteration: int = Field(primary_key=True)
    loss: float
    terms: dict[str, float] = json_column()
    violations: int


class Query(SQLModel, table=True):
    """A stored question."""

    __table_args__ = (
        one_of("kind", "similarity", "preference", "pair", "closer"),
        one_of("state", "open", "answered", "withdrawn"),
        Index("uq_query_fingerprint", "run_id", "fingerprint", unique=True),
    )
    id: str = Field(default_factory=new_id, primary_key=True)
    run_id: str = owned("run.id")
    project_id: str = owned("project.id")
    tool_id: str = owned("tool.id")
    demonstration_id: str | None = owned("demonstration.id", nullable=True)  # a pair belongs to none
    kind: str
    state: str = "open"
    round: int
    checkpoint: int  # the run's checkpoint that asked it
    number: int  # within its round, from 1
    left: list[int] = json_column()
    right: list[int] = json_column()
    why: str
    difference: str
    differs: list[int] = json_column()
    fingerprint: str
    created_at: str = Field(default_factory=now)


class Answer(SQLModel, table=True):
    """A reply; never changed. Taking one back adds a row with the value "undone" that supersedes it."""

    __table_args__ = (
        one_of("value", "similar", "not_similar", "cant_tell", "left", "right", "equal", "both_wrong", "left_mine", "right_mine", "undone"),
        Index("uq_answer_current", "query_id", unique=True, sqlite_where=text("superseded_by IS NULL")),
    )
    id: str = Field(default_factory=new_id, primary_key=True)
    query_id: str = owned("query.id")
    value: str
    client_key: str | None = None
    superseded_by: str | None = None
    created_at: str = Field(default_factory=now)


class PolicyRow(SQLModel, table=True):
    """Learned weights and the feature set they belong to."""

    __tablename__ = "policy"  # pyright: ignore[reportAssignmentType]
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    run_id: str = owned("run.id")
    name: str
    feature_set: str
    feature_version: int
    interactions: list[dict[str, str]] = json_column()
    weights: list[float] = json_column()
    identifiable: list[bool] = json_column()
    effort_weights: list[float] | None = json_column(nullable=True)
    converged: bool
    certificate: Json | None = json_column(nullable=True)  # of a certified run: its last report
    learned_from: dict[str, int] = json_column()  # {demonstrations, answers}
    created_at: str = Field(default_factory=now)


class ToolException(SQLModel, table=True):
    """The order an expert wants on one tool, found by questions about it; the newest that wasn't dropped counts."""

    __tablename__ = "tool_exception"  # pyright: ignore[reportAssignmentType]
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    tool_id: str = owned("tool.id")
    segmentation_id: str = owned("segmentation.id")
    run_id: str = owned("run.id")
    sequence: list[int] = json_column()
    answers: int
    probability: float  # given the answers; 1: the expert said that it is theirs
    created_at: str = Field(default_factory=now)
    dropped_at: str | None = None


class Plan(SQLModel, table=True):
    """A policy on a tool."""

    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    policy_id: str = owned("policy.id")
    tool_id: str = owned("tool.id")
    segmentation_id: str = owned("segmentation.id")
    sequence: list[int] = json_column()
    result: Json = json_column()
    created_at: str = Field(default_factory=now)


class PlaybackRow(SQLModel, table=True):
    """A simulated execution of a plan."""

    __tablename__ = "playback"  # pyright: ignore[reportAssignmentType]
    __table_args__ = (one_of("state", "queued", "running", "ready", "failed"),)
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    plan_id: str = owned("plan.id")
    tool_id: str = owned("tool.id")
    state: str = "queued"
    parameters: Json = json_column()
    artifact_sha: str | None = owned("artifact.sha", nullable=True)
    summary: Json | None = json_column(nullable=True)
    error: Json | None = json_column(nullable=True)
    created_at: str = Field(default_factory=now)


class ViewSession(SQLModel, table=True):
    """A person's 3D view and what it shows."""

    __tablename__ = "view_session"  # pyright: ignore[reportAssignmentType]
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    scene: Json = json_column()
    playback: Json = json_column()
    created_at: str = Field(default_factory=now)


class EventRow(SQLModel, table=True):
    """The outbox: written with the change it tells of."""

    __tablename__ = "event"  # pyright: ignore[reportAssignmentType]
    __table_args__ = ({"sqlite_autoincrement": True},)
    id: int | None = Field(default=None, primary_key=True)
    project_id: str | None = Field(default=None, index=True)
    type: str
    data: Json = json_column()
    created_at: str = Field(default_factory=now, index=True)


class Idempotency(SQLModel, table=True):
    """The answer to a POST that came with a key."""

    key: str = Field(primary_key=True)
    request_hash: str
    status: int
    headers: dict[str, str] = json_column()
    body: str
    created_at: str = Field(default_factory=now)


class JobRow(SQLModel, table=True):
    """One piece of background work."""

    __tablename__ = "job"  # pyright: ignore[reportAssignmentType]
    __table_args__ = (
        one_of("state", *JOB_STATES),
        CheckConstraint("fraction BETWEEN 0 AND 1", name="fraction"),
        Index("ix_job_queue", "state", "id"),
    )
    id: str = Field(default_factory=new_id, primary_key=True)
    project_id: str = owned("project.id")
    kind: str
    subject_id: str = Field(index=True)
    title: str
    args: Json = json_column()
    state: str = "queued"
    fraction: float = 0.0
    message: str = ""
    error: Json | None = json_column(nullable=True)
    attempt: int = 0
    created_at: str = Field(default_factory=now)
    started_at: str | None = None
    finished_at: str | None = None
