"""The settings of a rule base, as they stand in the ``[learner.rule_base]`` table of a spec."""

from typing import Annotated, Literal

from pydantic import Field

from ..plugins.settings import Positive, Settings


class RuleBaseSettings(Settings):
    """The fuzzy rule base that every agent holds (Section IV-B)."""

    membership: Literal["triangular", "sigmoid"] = "triangular"
    """Shape of the membership functions; the paper's are differences of sigmoids (Eq. 6)."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Membership functions per variable, spread evenly; none: the state space's own centres."""
    steepness: Positive = 8.0
    """Sigmoid slope times the distance of neighbouring centres (c_j of Eq. 6, dimensionless)."""
    order: Annotated[int, Field(ge=1, le=12)] | Literal["full"] = 1
    """Variables per rule: 1 sums one-variable rule bases, d or ``full`` is the paper's product of
    all variables. 2 where what one variable is worth depends on another; it takes more episodes."""
    products: tuple[tuple[str, ...], ...] = ()
    """Further products of variables by name, summed to those of `order`."""
    precision: Literal["float64", "float32"] = "float64"
    """Precision of the consequent weights and traces; float32 halves memory and traffic."""
