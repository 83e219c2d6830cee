"""Whether the results of one spec may stand beside those of another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from .errors import show
from .overlay import flat
from .spec import Spec


def difference(old: Spec, old_settings: Mapping[str, Mapping[str, Any]], new: Spec) -> str | None:
    """Return one line on what keeps `new` from being added to `old`; None if nothing does.

    Only what the specs mean is compared, not how they are written. Seeds may be added.

    Parameters
    ----------
    old
        The spec whose results exist.
    old_settings
        Its conditions' settings by label, as they were when it was run: presets and defaults may
        have changed since.
    new
        The spec that is to be run.
    """
    found = list(_differences(old, old_settings, new))
    if not found:
        return None
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return f"{found[0]}{more}; use another directory"


def _differences(
    old: Spec, old_settings: Mapping[str, Mapping[str, Any]], new: Spec
) -> Iterator[str]:
    for name in ("study", "episodes", "steps", "evaluation", "evaluation_steps"):
        before, after = getattr(old, name), getattr(new, name)
        if before != after:
            yield f"{name} = {show(before)} there, {show(after)} here"
    if old.evaluations != new.evaluations:
        then, now = (show(list(spec.evaluations)) for spec in (old, new))
        yield f"evaluations = {then} there, {now} here"
    if not set(old.seeds) <= set(new.seeds):
        yield f"seeds = {show(old.seeds)} there, {show(new.seeds)} here"
    for name in sorted(old.sources.texts.keys() & new.sources.texts.keys()):
        if old.sources.digest(name) != new.sources.digest(name):
            yield f"{name} has changed since"
    settings = {c.label: c.settings.model_dump(mode="json") for c in new.conditions()}
    if list(settings) != list(old_settings):
        yield f"conditions = {show(list(old_settings))} there, {show(list(settings))} here"
    for before_stages, after_stages in zip(_curricula(old), _curricula(new), strict=False):
        if before_stages != after_stages:
            yield f"curriculum = {show(before_stages)} there, {show(after_stages)} here"
    before_keys, after_keys = _columns(old), _columns(new)
    if before_keys != after_keys:
        yield f"columns = {show(before_keys)} there, {show(after_keys)} here"
    for label in [label for label in settings if label in old_settings]:
        before, after = dict(flat(old_settings[label])), dict(flat(settings[label]))
        for key in sorted(before.keys() | after.keys()):
            if before.get(key) != after.get(key):
                then, now = show(before.get(key, "absent")), show(after.get(key, "absent"))
                yield f"condition {label!r}: {key} = {then} there, {now} here"


def _curricula(spec: Spec) -> list[list[Mapping[str, Any]]]:
    """Return the stages of the spec and of each of its overrides, as they are written."""
    found = [spec.curriculum]
    found += [spec.curriculum if o.curriculum is None else o.curriculum for o in spec.overrides]
    return [[stage.model_dump() for stage in stages] for stages in found]


def _columns(spec: Spec) -> list[str]:
    return list(spec.conditions()[0].columns)
