"""Projects as REST shows them, and the changes that several actions share."""

from typing import Any

from sqlmodel import Session, col, func, select

from app.errors import InvalidInput, UnknownFeature
from app.jobs.rows import running_jobs
from app.sequencing.features import DEFAULT_INTERACTIONS, FACTOR_WORDS, FeatureSet, Interaction, interaction_label
from app.storage import emit
from app.storage.identity import now
from app.storage.tables import Demonstration, Project, ToolRow
from app.workflow.feature_choice import project_features
from app.workflow.lookup import open_query_count, tools_of
from app.workflow.reports import rho
from app.workflow.stages import Progress, next_step, stages
from app.workflow.values import Values

Json = dict[str, Any]


def add_project(session: Session, name: str, process: str, *, sample: bool = False) -> Project:
    """The row of a new project."""
    row = Project(name=checked_name(name), process=process, template="layup", sample=sample, interactions=stored(DEFAULT_INTERACTIONS))
    session.add(row)
    session.flush()
    emit(session, "project.changed", row.id)
    return row


def touch(session: Session, row: Project) -> None:
    """Count a change and tell of it."""
    row.version, row.updated_at = row.version + 1, now()
    session.add(row)
    emit(session, "project.changed", row.id)


def checked_name(name: str) -> str:
    """A name as stored.

    Raises:
        InvalidInput: Empty, or longer than 120 characters.
    """
    name = name.strip()
    if not 1 <= len(name) <= 120:
        raise InvalidInput("A name has 1 to 120 characters.")
    return name


def stored(interactions: tuple[Interaction, ...]) -> list[dict[str, str]]:
    """Interactions as a JSON column holds them."""
    return [{"first": i.first, "second": i.second} for i in interactions]


def checked_interactions(features: FeatureSet, interactions: list[dict[str, str]]) -> list[dict[str, str]]:
    """Interactions as stored.

    Raises:
        InvalidInput: One is named twice, or pairs a factor with itself.
        UnknownFeature: A factor that the project's features don't have.
    """
    seen: set[frozenset[str]] = set()
    for pair in interactions:
        for key in (pair["first"], pair["second"]):
            if key not in features.factors:
                raise UnknownFeature(f"There is no feature {key!r}. Known are: {', '.join(sorted(features.factors))}.")
        both = frozenset((pair["first"], pair["second"]))
        if len(both) < 2:
            raise InvalidInput(f"An interaction needs two different features, not {pair['first']} twice.")
        if both in seen:
            raise InvalidInput(f"The interaction of {pair['first']} and {pair['second']} is named twice.")
        seen.add(both)
    return [{"first": pair["first"], "second": pair["second"]} for pair in interactions]


def labelled(interactions: list[dict[str, str]], features: FeatureSet) -> list[Json]:
    """Interactions with words."""
    return [{**i, "label": interaction_label(Interaction(i["first"], i["second"]), features)} for i in interactions]


def interaction_choices(features: FeatureSet) -> list[Json]:
    """All pairs of factors that have plain names, own features among them."""
    own = [features.columns[i].key for i in range(len(features.columns) - len(features.plugins), len(features.columns))]
    keys = [key for key in FACTOR_WORDS if key in features.factors] + own
    pairs = [{"first": a, "second": b} for k, a in enumerate(keys) for b in keys[k + 1 :]]
    usual = [p for p in stored(DEFAULT_INTERACTIONS) if {p["first"], p["second"]} <= features.factors.keys()]
    return labelled(usual + [p for p in pairs if p not in usual and {"first": p["second"], "second": p["first"]} not in usual], features)


def project_json(values: Values, session: Session, row: Project) -> Json:
    """The project as REST shows it."""
    features = project_features(session, row.id)
    progress = Progress.of(session, row.id, rho(values, session, row))
    demonstrations = select(func.count()).select_from(Demonstration).join(ToolRow, col(ToolRow.id) == col(Demonstration.tool_id))
    demonstrations = demonstrations.where(
        Demonstration.project_id == row.id,
        col(Demonstration.deleted_at).is_(None),
        col(Demonstration.superseded_by).is_(None),
        col(ToolRow.deleted_at).is_(None),
    )
    return {
        "id": row.id,
        "name": row.name,
        "process": row.process,
        "template": row.template,
        "sample": row.sample,
        "interactions": labelled(row.interactions, features),
        "interaction_choices": interaction_choices(features),
        "version": row.version,
        "created_at": row.created_at,
        "updated_at": row.updated_at,
        "counts": {
            "tools": len(tools_of(session, row.id)),
            "demonstrations": session.exec(demonstrations).one(),
            "open_queries": open_query_count(session, row.id),
        },
        "rho": progress.rho,
        "stages": stages(progress),
        "next_step": next_step(progress),
        "running": running_jobs(session, row.id),
    }
