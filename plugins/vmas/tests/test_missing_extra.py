"""Without VMAS the plug-in names the command that installs it."""

import sys

import pytest

from nested_agents.scenarios import SCENARIOS


def test_without_the_extra_it_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "vmas", None)
    with pytest.raises(ValueError, match=r"VMAS is not installed; pip install"):
        SCENARIOS.parsed("vmas", task="balance").build()
