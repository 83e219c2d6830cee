"""Compiled kernels of the rule base: the same numbers as the NumPy definitions, fast.

Every kernel has a plain-NumPy reference implementation: firing strengths in
`core.rules.kernels.fuzzy`,
features in `RuleBase.features`, values and temporal differences in `core.rules.reference`. Nothing
is compiled on import; each kernel is compiled at its first call and cached on disk.

The dense kernels leave out rules if all of them that share all but the last two variables come to
less than `NEGLIGIBLE`: firing strengths sum to one, so that a value of the paper's rule base, with
its 5^5 such parts, changes by less than 1e-12 of the largest weight.
"""

from .compact import active_compact, each_compact, td_compact, total_compact, values_compact
from .dense import values_dense
from .enumeration import Tried, enumerate_contracted, enumerate_dense, enumerate_looked_up
from .few_states import each_dense, td_dense
from .layout import Layout, Packed, layout, unpack
from .strengths import NEGLIGIBLE, exponential, many_strengths, strengths_of
from .updates import add_features, td_update

__all__ = [
    "NEGLIGIBLE",
    "Layout",
    "Packed",
    "Tried",
    "active_compact",
    "add_features",
    "each_compact",
    "each_dense",
    "enumerate_contracted",
    "enumerate_dense",
    "enumerate_looked_up",
    "exponential",
    "layout",
    "many_strengths",
    "strengths_of",
    "td_compact",
    "td_dense",
    "td_update",
    "total_compact",
    "unpack",
    "values_compact",
    "values_dense",
]
