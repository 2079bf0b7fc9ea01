"""Which features count: a built-in set without some of its features, and with an engineer's own added.

The choice is spelled in the set's name, so that weights name exactly what they belong to: `clean~jump~height+small_first@1a2b3c4d`
is `clean` without two features and with one of one's own in the version 1a2b3c4d.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from app.errors import InvalidInput, UnknownFeature
from app.sequencing.features import FEATURE_SETS, Feature, FeatureSet, base_name
from app.sequencing.plugins import OwnFeature


def chosen_features(base: FeatureSet, without: Iterable[str] = (), own: Iterable[OwnFeature] = ()) -> FeatureSet:
    """The set with features switched off and added.

    Args:
        base: A built-in set.
        without: Factors to switch off; one that stands for several columns ("height") switches off all of them.
        own: Features to add.

    Raises:
        UnknownFeature: A factor that the set doesn't have.
        InvalidInput: Nothing is left, or an own feature has the key of another one.
    """
    off, added = sorted(set(without)), sorted(own, key=lambda o: o.key)
    for key in off:
        if key not in base.factors:
            raise UnknownFeature(f"There is no feature '{key}' to switch off. Choose from: {', '.join(sorted(base.factors))}.")
    gone = {i for key in off for i in base.factors[key]}
    kept = [i for i in range(len(base.columns)) if i not in gone]
    if not kept and not added:
        raise InvalidInput("At least one feature must stay switched on.")
    taken = {*base.factors, *(c.key for c in base.columns)}
    for o in added:
        if o.key in taken:
            raise InvalidInput(f"There is a feature called '{o.key}' already; give yours another KEY.")
        taken.add(o.key)
    columns = [base.columns[i] for i in kept] + [Feature(o.key, o.label, f"phi_own_{k}") for k, o in enumerate(added, 1)]
    place = {old: new for new, old in enumerate(kept)}
    factors = {key: tuple(place[i] for i in old if i in place) for key, old in base.factors.items()}
    factors = {key: columns_of for key, columns_of in factors.items() if columns_of}
    factors |= {o.key: (len(kept) + k,) for k, o in enumerate(added)}
    name = base.name + "".join(f"~{key}" for key in off) + "".join(f"+{o.key}@{o.version}" for o in added)
    return replace(base, name=name, columns=tuple(columns), factors=factors, plugins=tuple(added))


def features_named(name: str, own: Mapping[str, OwnFeature] | None = None) -> FeatureSet:
    """The set that a name stands for.

    Args:
        name: As `chosen_features` makes it.
        own: Known own features by "key@version".

    Raises:
        UnknownFeature: A set or an own feature that isn't known (any more).
    """
    base, rest = base_name(name), name.split("+")
    if base not in FEATURE_SETS:
        raise UnknownFeature(f"There is no feature set '{base}'. Known are: {', '.join(FEATURE_SETS)}.")
    missing = [word for word in rest[1:] if word not in (own or {})]
    if missing:
        raise UnknownFeature(f"The feature '{missing[0]}' isn't known here; put its file back, or learn a new policy without it.")
    return chosen_features(FEATURE_SETS[base], rest[0].split("~")[1:], [(own or {})[word] for word in rest[1:]])
