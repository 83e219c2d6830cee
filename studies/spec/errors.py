"""What is wrong with a spec, see `nested_agents.studies.errors`."""

from ..errors import SpecError as SpecError
from ..errors import show as show
