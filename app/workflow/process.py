"""The kind of work of a project: which features count, how levels are made, and the templates it can start from."""

from dataclasses import asdict
from typing import Any

from sqlmodel import Session, col, select

from app.errors import InvalidFeature, InvalidInput, NotFound, UnknownFeature
from app.learning.process_templates import BUILT_IN, ProcessTemplate, template_of
from app.sequencing.choice import chosen_features
from app.sequencing.feature_words import SENTENCES
from app.sequencing.features import FEATURE_SETS, FeatureSet
from app.sequencing.plugins import OwnFeature
from app.storage import emit
from app.storage.identity import now
from app.storage.process_tables import OwnFeatureRow, ProcessTemplateRow
from app.storage.tables import Project
from app.workflow.context import Context
from app.workflow.coverage import checked_thresholds
from app.workflow.feature_choice import FOLDER, base_set, examined, own_features, own_files, project_features
from app.workflow.lookup import check_version, current_segmentation, found, present, refuse_while_training, tools_of
from app.workflow.project_rows import checked_interactions, checked_name, labelled, touch

Json = dict[str, Any]

BY_HAND = ("chosen", "expert")  # levels set for single features


def get_process(ctx: Context, project_id: str) -> Json:
    """Features, own features and levels of a project."""
    return ctx.store.read(lambda session: process_json(ctx, session, present(session, Project, project_id)))


def set_process(ctx: Context, project_id: str, changes: Json, version: int | None = None) -> Json:
    """Start from a template, or switch single features on and off.

    Args:
        ctx: Where.
        project_id: Which.
        changes: Any of `template` (key or id), `without` (factors), `own` (keys of files in the folder), `levels` ("quantile" | "range"),
            `by_hand` (levels of single features, as `get_process` gave them), `interactions` (pairs of factors).
        version: The version the caller has seen.

    Raises:
        UnknownFeature: A feature that isn't there.
        InvalidFeature: An own feature breaks the contract.
        RunActive: A run is learning.
    """

    def change(session: Session) -> None:
        project = present(session, Project, project_id)
        check_version(project, version)
        refuse_while_training(session, project)
        if changes.get("template") is not None:
            start_from(session, project, changes["template"])
        if changes.get("without") is not None:
            project.without = _checked(session, project, changes["without"])
        if changes.get("own") is not None:
            project.own = _switched_on(ctx, session, project, changes["own"])
        if changes.get("levels") is not None:
            project.levels = {**project.levels, "default": changes["levels"]}
        if changes.get("by_hand") is not None:
            project.levels = {"default": project.levels.get("default", "quantile"), **_checked_levels(session, project, changes["by_hand"])}
        chosen = project_features(session, project.id)  # refuses an empty or ambiguous choice
        if changes.get("interactions") is not None:
            project.interactions = checked_interactions(chosen, changes["interactions"])
        project.interactions = [i for i in project.interactions if {i["first"], i["second"]} <= chosen.factors.keys()]
        touch(session, project)
        emit(session, "coverage.changed", project.id)

    ctx.store.write(change)
    return get_process(ctx, project_id)


def process_json(ctx: Context, session: Session, project: Project) -> Json:
    """The process as REST shows it."""
    base = FEATURE_SETS[base_set(session, project.id)]
    chosen = project_features(session, project.id)
    keys = {c.key for c in chosen.columns}
    return {
        "project_id": project.id,
        "version": project.version,
        "template": project.template,
        "feature_set": chosen.name,
        "features": [_feature_json(key, base, keys) for key in _switches(base)],
        "own": _own_json(ctx, session, project),
        "own_folder": FOLDER,
        "levels": project.levels.get("default", "quantile"),
        "by_hand": {key: project.levels.get(key, {}) for key in BY_HAND},
        "interactions": labelled(project.interactions, chosen),
    }


def list_templates(ctx: Context) -> list[Json]:
    """Built-in templates, then saved ones, oldest first."""

    def query(session: Session) -> list[Json]:
        wanted = select(ProcessTemplateRow).where(col(ProcessTemplateRow.deleted_at).is_(None)).order_by(col(ProcessTemplateRow.id))
        return [_built_in_json(t) for t in BUILT_IN] + [_saved_json(row) for row in session.exec(wanted)]

    return ctx.store.read(query)


def save_template(ctx: Context, project_id: str, name: str, why: str) -> Json:
    """Keep a project's choice as a template."""

    def change(session: Session) -> Json:
        project = present(session, Project, project_id)
        row = ProcessTemplateRow(
            name=checked_name(name),
            why=why.strip(),
            without=project.without,
            own=project.own,
            interactions=project.interactions,
            levels=project.levels,
        )
        session.add(row)
        session.flush()
        project.template = row.id
        touch(session, project)
        return _saved_json(row)

    return ctx.store.write(change)


def change_template(ctx: Context, template_id: str, changes: Json) -> Json:
    """Rename a saved template or say why it is as it is; built-in ones can't be changed, only copied."""

    def change(session: Session) -> Json:
        row = _saved(session, template_id)
        row.name = checked_name(changes.get("name") or row.name)
        row.why = (changes.get("why") or row.why).strip()
        row.version += 1
        session.add(row)
        return _saved_json(row)

    return ctx.store.write(change)


def delete_template(ctx: Context, template_id: str) -> None:
    """Put a saved template away; projects that started from it keep their choice."""

    def change(session: Session) -> None:
        row = _saved(session, template_id)
        row.deleted_at = now()
        session.add(row)

    ctx.store.write(change)


def _saved(session: Session, template_id: str) -> ProcessTemplateRow:
    if template_of(template_id):
        raise InvalidInput("Built-in templates can't be changed. Start a project from one, adjust it and save it as your own.")
    row = found(session, ProcessTemplateRow, template_id, "process template")
    if row.deleted_at is not None:
        raise NotFound(f"The process template {row.name!r} was deleted.")
    return row


def start_from(session: Session, project: Project, key: str) -> None:
    """Take over a template as far as the project's features go."""
    factors = FEATURE_SETS[base_set(session, project.id)].factors
    built_in = template_of(key)
    if built_in is None:
        row = _saved(session, key)
        without, own, levels, interactions = row.without, row.own, row.levels, row.interactions
    else:
        without, own, levels = list(built_in.without), [], {"default": built_in.levels}
        interactions = [{"first": i.first, "second": i.second} for i in built_in.interactions]
        project.process = built_in.name
    project.template, project.own, project.levels, project.interactions = key, own, levels, interactions
    project.without = [k for k in without if k in factors]


def _checked(session: Session, project: Project, without: list[str]) -> list[str]:
    base = FEATURE_SETS[base_set(session, project.id)]
    chosen_features(base, without)  # refuses unknown ones and an empty choice
    return sorted(set(without))


def _checked_levels(session: Session, project: Project, by_hand: Json) -> Json:
    """Levels of single features; one that is switched off now keeps its own until it counts again."""
    known = {*FEATURE_SETS[base_set(session, project.id)].factors, *project_features(session, project.id).factors}
    unknown = {key for kind in BY_HAND for key in by_hand[kind]} - known
    if unknown:
        raise UnknownFeature(f"There is no feature {min(unknown)!r} to set levels of. Known are: {', '.join(sorted(known))}.")
    return {"chosen": by_hand["chosen"], "expert": {key: checked_thresholds(tuple(pair)) for key, pair in by_hand["expert"].items()}}


def _switched_on(ctx: Context, session: Session, project: Project, keys: list[str]) -> list[str]:
    """Names of the own features with these keys; their texts are kept.

    Paper: a feature must keep to the contract on the built-in moulds' and the project's tools alike, because weights mean the same on all.
    """
    files = {own.key: (own, faults) for own, faults in _examined(ctx, session, project) if own is not None}
    named = []
    for key in sorted(set(keys)):
        if key not in files:
            raise UnknownFeature(f"No file in the folder '{FOLDER}' defines a feature '{key}'. Known are: {', '.join(files) or 'none'}.")
        own, faults = files[key]
        if faults:
            raise InvalidFeature(f"The feature '{key}' can't be used. {' '.join(faults)}")
        name = f"{own.key}@{own.version}"
        session.merge(OwnFeatureRow(id=name, key=own.key, label=own.label, source=own.source))
        named.append(name)
    session.flush()
    return named


def _examined(ctx: Context, session: Session, project: Project) -> list[tuple[OwnFeature | None, tuple[str, ...]]]:
    cuts = [cut for t in tools_of(session, project.id) if (cut := current_segmentation(session, t.id))]
    graphs = [ctx.values.tool(session, cut).graph for cut in cuts]
    return [examined(path, graphs) for path in own_files(ctx.settings.data)]


def _own_json(ctx: Context, session: Session, project: Project) -> list[Json]:
    """Files in the folder, and features in use whose file has changed or gone."""
    listed, seen = [], set()
    for path, (own, faults) in zip(own_files(ctx.settings.data), _examined(ctx, session, project), strict=True):
        name = f"{own.key}@{own.version}" if own else None
        seen.add(name)
        listed.append(
            {
                "file": path.name,
                "key": own.key if own else None,
                "label": own.label if own else None,
                "version": own.version if own else None,
                "on": name in project.own,
                "faults": list(faults),
            }
        )
    kept = own_features(session, [name for name in project.own if name not in seen])
    return listed + [
        {"file": None, "key": own.key, "label": own.label, "version": own.version, "on": True, "faults": []} for own in kept.values()
    ]


def _switches(base: FeatureSet) -> list[str]:
    """What can be switched: every factor once, a feature of several columns as one."""
    joint = {i for columns in base.factors.values() if len(columns) > 1 for i in columns}
    single = [c.key for i, c in enumerate(base.columns) if i not in joint]
    return single + [key for key, columns in base.factors.items() if len(columns) > 1]


def _feature_json(key: str, base: FeatureSet, on: set[str]) -> Json:
    columns = [base.columns[i] for i in base.factors[key]]
    label = columns[0].label if len(columns) == 1 else f"Change of {key}"
    return {
        "key": key,
        "label": label,
        "symbol": ", ".join(c.symbol for c in columns),
        "sentence": SENTENCES.get(key, ""),
        "on": any(c.key in on for c in columns),
    }


def _built_in_json(template: ProcessTemplate) -> Json:
    value = asdict(template)
    return {
        "id": value["key"],
        "name": value["name"],
        "why": value["why"],
        "built_in": True,
        "without": list(value["without"]),
        "own": [],
        "interactions": list(value["interactions"]),
        "levels": value["levels"],
    }


def _saved_json(row: ProcessTemplateRow) -> Json:
    return {
        "id": row.id,
        "name": row.name,
        "why": row.why,
        "built_in": False,
        "without": row.without,
        "own": row.own,
        "interactions": row.interactions,
        "levels": row.levels.get("default", "quantile"),
    }
