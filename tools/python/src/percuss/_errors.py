"""What goes wrong, as exceptions."""

from __future__ import annotations

from typing import NamedTuple


class Error(Exception):
    """What this package raises of its own."""


class RecordingError(Error, ValueError):
    """A file is no sound recording of percuss, or does not hold what is asked for."""


class Place(NamedTuple):
    """Where a problem is, from 1 on."""

    text: str
    """The case file; `--set` of what was set."""
    line: int
    column: int


class Problem(NamedTuple):
    """A problem of a case."""

    message: str
    """What is wrong, with the key and its value."""
    help: str | None
    """What is possible."""
    place: Place | None


class CaseError(Error, ValueError):
    """The case, or what is asked of it, is not possible. The text shows every problem in its place."""

    def __init__(self, text: str, problems: tuple[Problem, ...] = ()) -> None:
        super().__init__(text)
        self.problems = problems
        """The problems of the case; empty if it is what is asked of it that is not possible, as values that vary."""


class RunError(Error, RuntimeError):
    """The program failed, as where an output exists or cannot be written, or a signal ended it."""
