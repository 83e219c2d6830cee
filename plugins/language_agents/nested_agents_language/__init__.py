"""Slow or paid calls as agents: concurrent, with time limits and recorded answers."""

from .calls import CallError, slow_calls
from .record import RecordedAnswers, RecordError

__all__ = ["CallError", "RecordError", "RecordedAnswers", "slow_calls"]
