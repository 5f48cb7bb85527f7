"""The program `percuss`: where it is, running it, its progress."""

from __future__ import annotations

import functools
import json
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from importlib import metadata

from ._errors import CaseError, Error, Place, Problem, RunError

INTERVAL = 0.5
"""Time between lines of progress [s]."""
GUARD = 'trap : INT TERM HUP; read -r ended || kill -INT "$1"'
"""Of the shell: interrupts a process, once, where a signal or the end of Python ends the input before a line that says that the process
has ended."""
INVALID = 2
"""Exit status of the program where the case or its arguments are invalid."""


@functools.cache
def find(name: str) -> str:
    """Path of a program: that of the installed package, else that of the search path.

    Raises:
        Error: There is none.
    """
    try:
        files = metadata.files("percuss") or []
    except metadata.PackageNotFoundError:
        files = []
    installed = next((str(file.locate()) for file in files if file.name == name), None)
    found = installed or shutil.which(name)
    if found is None:
        raise Error(f"`{name}` is neither in the installed package nor on PATH: install a wheel that has the programs")
    return found


def execute(verb: str, *arguments: str, progress: bool | None = False) -> str:
    """Runs a verb of `percuss`, and returns what it prints.

    An interruption, as by Ctrl-C or of the kernel of a notebook, interrupts the program, and is raised once that has ended. The end
    of Python, whatever its cause, interrupts the program too, but in a thread not where its whole process group is killed.

    Args:
        verb: The verb.
        arguments: Its arguments.
        progress: Show progress on standard error; None: if that is a terminal, or Python is interactive, as in a notebook.

    Raises:
        CaseError: The case or the arguments are invalid.
        RunError: The program failed.
    """
    if progress is None:
        progress = sys.stderr.isatty() or hasattr(sys, "ps1")
    command = [find("percuss"), verb, *([f"--progress-every={INTERVAL}"] if progress else []), *arguments]
    # Python interrupts its main thread only: for others the guard has the signals of the terminal, too
    is_main = threading.current_thread() is threading.main_thread()
    bar = Bar()
    said: list[str] = []
    # in a group of its own the program has one signal of Ctrl-C: a second one would end it at once
    with (
        tempfile.TemporaryFile("w+", encoding="utf-8") as output,
        subprocess.Popen(command, stdout=output, stderr=subprocess.PIPE, encoding="utf-8", process_group=0) as child,
        subprocess.Popen(
            ["/bin/sh", "-c", GUARD, "sh", str(child.pid)], stdin=subprocess.PIPE, encoding="utf-8", start_new_session=is_main
        ) as guard,
    ):
        assert child.stderr is not None
        try:
            for line in child.stderr:
                if not (progress and bar.advance(line)):
                    said.append(line)
            status = child.wait()
        except BaseException:
            child.send_signal(signal.SIGINT)
            child.stderr.read()
            child.wait()
            bar.end(False)
            raise
        finally:
            guard.communicate("\n")
        bar.end(status == 0)
        output.seek(0)
        printed = output.read()
    if status != 0:
        first = next((number for number, line in enumerate(said) if line.startswith("error: ")), 0)
        text = "".join(said[first:]).removeprefix("error: ").strip() or f"percuss {verb} ended with status {status}"
        raise CaseError(text, _problems(printed)) if status == INVALID else RunError(text)
    return printed


def _problems(printed: str) -> tuple[Problem, ...]:
    """The problems of an invalid case, which `check --json` prints, and nothing else."""
    problems = json.loads(printed)["problems"] if printed else []
    return tuple(Problem(**problem | {"place": (place := problem["place"]) and Place(**place)}) for problem in problems)


class Bar:
    """A bar that grows on standard error; nothing before the first line of progress."""

    WIDTH = 30

    def __init__(self) -> None:
        self.length = 0
        self.start = time.monotonic()

    def advance(self, line: str) -> bool:
        """Shows a line, if it is one of progress."""
        shares = re.match(r"(?:t = .*, step )?(\d+) of (\d+)(?: cases)?, .*ETA", line)
        if shares is None:
            return False
        self._draw(int(shares[1]) / int(shares[2]), line.strip())
        return True

    def end(self, is_done: bool) -> None:
        """Ends the line, if there is one."""
        if self.length > 0:
            if is_done:
                self._draw(1.0, f"{time.monotonic() - self.start:.1f} s")
            print(file=sys.stderr)

    def _draw(self, share: float, text: str) -> None:
        text = f"{'█' * int(self.WIDTH * share):░<{self.WIDTH}} {share:4.0%}  {text}"
        # over all of the line before
        print(f"\r{text:<{self.length}}", end="", file=sys.stderr, flush=True)
        self.length = len(text)
