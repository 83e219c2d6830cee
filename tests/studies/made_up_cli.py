"""The command line with made-up results: ``python made_up_cli.py MEASURE ARGUMENTS...``."""

import sys

import made_up

from nested_agents.studies import conduct, learning_curve
from nested_agents.studies.cli import main

if __name__ == "__main__":
    learning_curve.measure = getattr(made_up, sys.argv[1])
    conduct.check = lambda spec: None
    sys.exit(main(sys.argv[2:]))
