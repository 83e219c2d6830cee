"""The hierarchies of a spec, as they are built over the agents of its scenarios."""

from ...core.agents.cost import below_counts
from ...core.interface.scenario import groups_of
from ...topologies.view import HierarchyView
from ..errors import refused
from ..spec.conditions import ConditionSettings
from ..spec.spec import Spec


def views(spec: Spec) -> list[HierarchyView]:
    """Return the distinct hierarchies of a spec's conditions and evaluations.

    Each is called by the first that has it.

    Raises
    ------
    SpecError
        If one cannot be built; one line.
    """
    distinct: dict[tuple[object, ...], HierarchyView] = {}
    with spec.sources.active():
        for condition in spec.conditions():
            others = {f"{condition.label}, {name}": s for name, s in condition.evaluations}
            for label, settings in ({condition.label: condition.settings} | others).items():
                with refused(after=f" (condition {label!r})"):
                    view = _view(label, settings)
                hierarchy = view.hierarchy
                parts = hierarchy.told, hierarchy.considers, view.failures, view.tries
                distinct.setdefault((hierarchy.agents, hierarchy.edges, *parts), view)
    return list(distinct.values())


def _view(label: str, settings: ConditionSettings) -> HierarchyView:
    scenario, hierarchy = settings.arrange(settings.scenario.build())
    actions = len(scenario.action_set)
    tries = tuple(actions ** (1 + below) for below in below_counts(hierarchy))
    failures = settings.topology.failures
    return HierarchyView(label, hierarchy, groups_of(scenario), tries, failures)
