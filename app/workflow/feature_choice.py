"""Which features count in a project, and the texts of the features that engineers wrote."""

from pathlib import Path

from sqlmodel import Session, col, select

from app.errors import InvalidFeature
from app.geometry.tool import RegionGraph
from app.sequencing.choice import chosen_features, features_named
from app.sequencing.contract import contract_faults
from app.sequencing.features import FEATURE_SETS, FeatureSet
from app.sequencing.plugins import OwnFeature, read_own_feature
from app.storage.process_tables import OwnFeatureRow
from app.storage.tables import Project, Segmentation, ToolRow
from app.workflow.lookup import found, standing

FOLDER = "features"  # in the data folder: one Python file per own feature
ANY_TOOL = "layout"  # the set whose columns are defined for every tool


def base_set(session: Session, project_id: str) -> str:
    """The feature set of the demonstrated tools, else of the oldest tool, else the one for meshes."""
    demonstrated = standing(session, project_id)
    wanted = select(Segmentation).join(ToolRow, col(ToolRow.id) == col(Segmentation.tool_id)).where(col(Segmentation.current))
    wanted = wanted.where(ToolRow.project_id == project_id, col(ToolRow.deleted_at).is_(None)).order_by(col(ToolRow.id))
    row = session.get(Segmentation, demonstrated[0].segmentation_id) if demonstrated else session.exec(wanted.limit(1)).first()
    return row.feature_set if row else "clean"


def project_features(session: Session, project_id: str, base: str | None = None) -> FeatureSet:
    """The features that count in a project; what is switched off and isn't in its feature set is passed over."""
    project = found(session, Project, project_id, "project")
    built_in = FEATURE_SETS[base or base_set(session, project_id)]
    own = own_features(session, project.own)
    return chosen_features(built_in, [key for key in project.without if key in built_in.factors], own.values())


def stored_features(session: Session, name: str) -> FeatureSet:
    """The feature set that a run or policy names.

    Raises:
        UnknownFeature: It names an own feature that was never switched on here.
    """
    return features_named(name, own_features(session, name.split("+")[1:]))


def own_features(session: Session, names: list[str]) -> dict[str, OwnFeature]:
    """Own features by "key@version", as they were when they were switched on."""
    rows = session.exec(select(OwnFeatureRow).where(col(OwnFeatureRow.id).in_(names))).all() if names else []
    return {row.id: OwnFeature(row.source) for row in rows}


def own_files(data: Path) -> list[Path]:
    """The files in the folder of own features."""
    folder = data / FOLDER
    return sorted(folder.glob("*.py")) if folder.is_dir() else []


def examined(path: Path, graphs: list[RegionGraph]) -> tuple[OwnFeature | None, tuple[str, ...]]:
    """What a file defines, and why it can't be used; the feature is None where it can't even be read."""
    try:
        own = read_own_feature(path)
    except InvalidFeature as error:
        return None, (str(error),)
    return own, contract_faults(own, graphs)
