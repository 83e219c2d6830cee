"""The command line with made-up results: ``python made_up_cli.py MEASURE ARGUMENTS...``."""

import sys

import made_up

from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main

if __name__ == "__main__":
    learning_curve.measure = getattr(made_up, sys.argv[1])
    studies_run.check = lambda spec, **_: made_up.MEASURES
    sys.exit(main(sys.argv[2:]))
