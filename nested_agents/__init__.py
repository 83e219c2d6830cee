"""Define hierarchies of learning agents and measure how learning, failure recovery and cost scale.

The names below are imported when they are first used, so that ``import nested_agents`` is quick.

Examples
--------
Two e-Pucks, their four wheels in a chain, learning by the default settings:

>>> import nested_agents as na
>>> scenario = na.BoxPushingSettings().build()
>>> hierarchy = na.build_hierarchy(na.parse_topology("chain"), scenario.agents)
>>> team = na.Team(na.BatchTDSettings(), scenario, hierarchy, na.policy_seed(0))
>>> steps = na.control_loop(scenario, team, episodes=1, steps=3, seed=0)
>>> [record.step for record in steps]
[0, 1, 2]
"""

from pathlib import Path
from pkgutil import resolve_name
from typing import Any

__version__: str

if not Path(__file__).with_name("core").exists():  # a checkout: the four folders are at the top
    __path__.append(str(Path(__file__).parents[1]))

from .core.isolation import ignore_settings_files

ignore_settings_files()

_PLACES = {
    "AgentDecision": "core.interface.experience:AgentDecision",
    "Agents": "core.interface.agents:Agents",
    "ActionSet": "core.interface.spaces:ActionSet",
    "Analysis": "studies.results.analysis:Analysis",
    "BatchTDSettings": "core.learners.batch:BatchTDSettings",
    "BoxPushing": "scenarios.box_pushing.scenario:BoxPushing",
    "BoxPushingSettings": "scenarios.box_pushing.config:BoxPushingSettings",
    "ChainView": "scenarios.kinematic_chain.variables:ChainView",
    "Counts": "core.interface.agents:Counts",
    "DecisionProblem": "core.search.evaluator:DecisionProblem",
    "Environments": "core.interface.environments:Environments",
    "DecisionContext": "core.search.evaluator:DecisionContext",
    "Evaluator": "core.search.evaluator:Evaluator",
    "EvaluatorSettings": "core.search:EvaluatorSettings",
    "ExplorationSettings": "core.search.exploration:ExplorationSettings",
    "Explorer": "core.search.exploration:Explorer",
    "FrozenSettings": "core.learners.td:FrozenSettings",
    "FuzzyAgents": "core.agents.fuzzy:FuzzyAgents",
    "GymnasiumSettings": "scenarios.adapters.settings:GymnasiumSettings",
    "Hierarchy": "core.hierarchy.hierarchy:Hierarchy",
    "KinematicChain": "scenarios.kinematic_chain.scenario:KinematicChain",
    "KinematicChainSettings": "scenarios.kinematic_chain.config:KinematicChainSettings",
    "Learner": "core.learners.learner:Learner",
    "LearnerSettings": "core.learners:LearnerSettings",
    "LineUpSettings": "scenarios.line_up:LineUpSettings",
    "Measure": "core.interface.measures:Measure",
    "Observation": "core.interface.experience:Observation",
    "Partition": "core.values.partitions:Partition",
    "RuleBase": "core.values.rule_base:RuleBase",
    "NO_SUCCESS": "core.interface.measures:NO_SUCCESS",
    "SUCCESS": "core.interface.measures:SUCCESS",
    "Prediction": "core.interface.prediction:Prediction",
    "AgentContext": "core.interface.agents:AgentContext",
    "Peer": "core.agents.peer:Peer",
    "PeerSettings": "core.agents.peer:PeerSettings",
    "Scenario": "core.interface.scenario:Scenario",
    "ScenarioSettings": "core.plugins.settings:ScenarioSettings",
    "Session": "studies.trials.session:Session",
    "Settings": "core.plugins.settings:Settings",
    "Spec": "studies.spec.spec:Spec",
    "StackedEnvironments": "core.interface.stacked:StackedEnvironments",
    "StateSpace": "core.interface.spaces:StateSpace",
    "Situation": "scenarios.box_pushing.states.situations:Situation",
    "SpecError": "studies.errors:SpecError",
    "Study": "studies.catalogue.study:Study",
    "StudyResults": "studies.api.study:StudyResults",
    "Summary": "studies.results.analysis:Summary",
    "TDLambdaSettings": "core.learners.td:TDLambdaSettings",
    "Team": "core.agents.team:Team",
    "TeamSettings": "core.learners.learner:TeamSettings",
    "TopologySettings": "topologies:TopologySettings",
    "Transitions": "core.interface.environments:Transitions",
    "Inbox": "core.hierarchy.stages:Inbox",
    "Transition": "core.interface.scenario:Transition",
    "Variable": "core.interface.spaces:Variable",
    "bootstrap": "studies.results.statistics:bootstrap",
    "build_hierarchy": "topologies:build",
    "check_scenario": "scenarios.checking.checker:check_scenario",
    "compare_table": "studies.api.loading:compare_table",
    "choice": "core.interface.spaces:choice",
    "cost_table": "studies.cost.table:cost_table",
    "control_loop": "core.agents.loop:control_loop",
    "detectable": "studies.results.power:detectable",
    "explain_decision": "core.agents.inspection:explain_decision",
    "from_gymnasium": "scenarios.adapters.scenario:from_gymnasium",
    "from_pettingzoo": "scenarios.adapters.scenario:from_pettingzoo",
    "greatest": "core.numerics:greatest",
    "keys": "studies.spec.keys:keys_below",
    "load": "studies.api.loading:load",
    "parse_topology": "topologies:parse",
    "plan": "studies.api.planning:plan",
    "policy_seed": "core.agents.loop:policy_seed",
    "power": "studies.results.power:power",
    "profile": "studies.cost.profile:profile",
    "rate": "studies.results.statistics:rate",
    "reevaluate": "studies.api.reevaluation:reevaluate",
    "run": "studies.api.running:run",
    "run_trial": "studies.trials.session:run_trial",
    "scaling_law": "studies.api.growth:scaling_law",
    "schema": "studies.spec.schema:schema",
    "seeds_for": "studies.results.power:seeds_for",
    "tune": "studies.api.tuning:tune",
    "state_variable": "scenarios.state_variables:state_variable",
}

__all__ = ["__version__", *_PLACES]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("nested-agents")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return resolve_name(f"{__name__}.{_PLACES[name]}")


def __dir__() -> list[str]:
    return __all__
