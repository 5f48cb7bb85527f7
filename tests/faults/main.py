"""Runs the parts of this test, see `run`: `main.py [--quick] [--seed N] [PART...] [FOLDER...]`.

Every part is a module with a function `prove(part)`, which checks with `part.check`, returns its numbers as a text, and raises
`Skipped` if this machine cannot run it.
"""

import argparse
import signal
import sys
import tempfile
import time
from pathlib import Path

import calls
import kill
import power
import races
import resume
import room
import same
import short
import signals
from common import Part, Programs, Skipped

PARTS = {module.__name__: module for module in (kill, calls, resume, short, room, races, same, signals, power)}
RELEASE = Path(__file__).resolve().parents[2] / "target" / "release"
# failures of a part that are printed
MOST_FAILURES = 20


def main():
    parser = argparse.ArgumentParser(prog="tests/faults/run", usage="%(prog)s [--quick] [--seed N] [PART...] [FOLDER...]")
    parser.add_argument("--quick", action="store_true", help="fewer instants, sizes and repetitions")
    parser.add_argument("--seed", type=int, default=1, help="of all that is random [default: 1]")
    parser.add_argument("names", nargs="*", metavar="PART or FOLDER", help=", ".join(PARTS))
    arguments = parser.parse_args()
    names = [name for name in arguments.names if name in PARTS]
    folders = [Path(name).resolve() for name in arguments.names if name not in PARTS] or [RELEASE]
    for folder in folders:
        if not (folder / "percuss").is_file() or not (folder / "percuss-read").is_file():
            sys.exit(f"`{folder}` is neither a part nor a folder of percuss and percuss-read; parts: {', '.join(PARTS)}")
    # a shell that runs this in the background may have them ignored, and programs that are started inherit that
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    failures = 0
    for name in names or PARTS:
        with tempfile.TemporaryDirectory(prefix=f"percuss-{name}-") as work:
            part = Part(name, [Programs(folder) for folder in folders], Path(work), arguments.quick, arguments.seed)
            failures += run(part)
    sys.exit(1 if failures else 0)


def run(part):
    """Proves one part and prints its line; the number of failures."""
    start = time.monotonic()
    try:
        text = PARTS[part.name].prove(part)
    except Skipped as reason:
        text = f"SKIPPED: {reason}"
    seconds = time.monotonic() - start
    print(f"{part.name:8} {text}; {part.checks} checks, {len(part.failures)} failures, {seconds:.0f} s", flush=True)
    for failure in part.failures[:MOST_FAILURES]:
        print(f"         FAILED {' '.join(failure.split())}", flush=True)
    if len(part.failures) > MOST_FAILURES:
        print(f"         and {len(part.failures) - MOST_FAILURES} more", flush=True)
    return len(part.failures)


if __name__ == "__main__":
    main()
