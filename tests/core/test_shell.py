"""Shell: commands are printed as they can be typed."""

import shlex
from pathlib import Path

import pytest

from nested_agents.core.shell import DEV, command_line


@pytest.mark.parametrize("dev", ["./dev", "../a checkout/dev", "/src/nested-agents/dev"])
def test_in_a_checkout_a_command_goes_through_dev(
    dev: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DEV, dev)
    written = command_line("table", Path("out/my study"), "--columns", "a, b")
    assert shlex.split(written) == [
        *(dev, "exec", "nested-agents", "table", "out/my study", "--columns", "a, b")
    ]


def test_an_installed_program_is_on_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(DEV, raising=False)
    assert command_line("table", "a b") == "nested-agents table 'a b'"
