"""The settings of predictions."""

from ....core.plugins.settings import Positive, Settings


class BeliefSettings(Settings):
    """Factors by which the constants of the push predictor differ from those of the world."""

    stiffness: Positive = 1.0
    """Factor on the stiffness of the wheels, ahead and sideways."""
    load: Positive = 1.0
    """Factor on the ground friction of the box."""
    contact_friction: Positive = 1.0
    """Factor on the friction between robots and box."""
