"""Run the command line: ``python -m nested_agents``."""

from .studies.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main())
