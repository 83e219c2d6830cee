"""The command line with made-up results: each command is a fork of a process that imports once.

``python made_up_cli.py SOCKET``: a message there begins a command, with two pipes for what it
writes, or asks whether one has ended. A command finds modules imported and nothing else done: it
has its own environment, streams, workers and threads, and ends as any program.
"""

import gc
import json
import os
import signal
import socket
import sys
from io import TextIOWrapper

import made_up
import matplotlib.pyplot  # noqa: F401

from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.commands import reading, running  # noqa: F401
from nested_agents.studies.cli.main import main
from nested_agents.studies.explain import text  # noqa: F401
from nested_agents.studies.report import page  # noqa: F401


def serve(channel: socket.socket) -> tuple[dict, list[int]]:
    """Answer until nobody asks any more; return only in a command, with what it is to do."""
    while True:
        message, pipes, _, _ = socket.recv_fds(channel, 2**20, 2)
        if not message:
            os._exit(0)
        task = json.loads(message)
        if isinstance(task, int):
            pid, status = os.waitpid(task, os.WNOHANG)
            answer = os.waitstatus_to_exitcode(status) if pid else None
        else:
            answer = os.fork()
            if not answer:
                return task, pipes
            for pipe in pipes:
                os.close(pipe)
        channel.send(json.dumps(answer).encode())


def become(environment: dict, folder: str, group: bool, encoding: str, buffered: bool) -> None:
    """Take on what a process is given when it begins."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever a shell did to it
    if group:
        os.setsid()
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    raw = open(1, "wb", -1 if buffered else 0, closefd=False)  # noqa: SIM115
    sys.stdout = TextIOWrapper(raw, encoding, write_through=not buffered)


if __name__ == "__main__":
    gc.freeze()  # a fork need not touch what it does not use
    with socket.socket(fileno=int(sys.argv[1])) as channel:
        task, pipes = serve(channel)
    for descriptor, pipe in enumerate(pipes, 1):
        os.dup2(pipe, descriptor)
        os.close(pipe)
    become(**task["process"])
    if task["measure"]:
        learning_curve.measure = getattr(made_up, task["measure"])
        studies_run.check_conditions = lambda spec, **_: made_up.MEASURES
    sys.argv = ["nested-agents", *task["arguments"]]
    sys.exit(main())
