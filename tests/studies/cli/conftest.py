"""The spec that commands are tried with."""

import made_up
import pytest

from nested_agents.studies.spec.tables import dumps


@pytest.fixture(scope="module")
def spec_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("spec") / "spec.toml"
    path.write_text(dumps(made_up.SPEC.table()))
    return path
