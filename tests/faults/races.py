"""Two processes that write one output, started at nearly the same time.

Without `--force` exactly one of them has the output; the other fails, says so, and changes nothing. With `--force` both may have it, one
after the other, and it replaces an older file. In every case the file is whole, and no part is left.

In every second race strace delays the calls on the output, by another time in each process: so a call of the one falls between any two of
the other.
"""

import contextlib
import subprocess

from collections import Counter

from commands import Command
from common import TINY, Skipped, end, leftovers, part_of, start
from tracing import need_strace

# between the two, at most [s]
APART = 0.03
# of a call on the output, at most [µs]
DELAY = 10_000
# what the one that comes second may say of the output
REASONS = ("exists; choose another", "is being written by another process")


def prove(part):
    """Every pair, many times."""
    folder = part.folder()
    source = part.work / "source.mcap"
    part.good(TINY, source)
    times = 10 if part.quick else 100
    pairs = [
        Command("run", [part.percuss, "run", *TINY, "--quiet"], folder / "run.mcap"),
        Command("trace", [part.reader, "trace", source], folder / "trace.csv"),
    ]
    try:
        need_strace(part.work)
        delays = (False, True)
    except Skipped as reason:
        print(f"races    SKIPPED in part: delayed calls: {reason}", flush=True)
        delays = (False,)
    texts = []
    for command in pairs:
        end(start(command.with_options()))
        content = command.content()
        for is_forced in (False, True):
            wins = Counter(race(part, command, content, is_forced, delays[n % len(delays)]) for n in range(times))
            force = " --force" if is_forced else ""
            texts.append(f"{command.name}{force}: {times} races, {wins[2]} with two winners")
    return "; ".join(texts)


def delayed(part, arguments, output):
    """The same command, every call on its output delayed by a random time."""
    delay = f"%file,flock,ftruncate,fsync:delay_exit={part.random.randrange(DELAY)}"
    paths = [option for path in (output, part_of(output)) for option in ("-P", path)]
    return ["strace", "-f", "-o", "/dev/null", "-e", "trace=%file,flock,ftruncate,fsync", *paths, "-e", f"inject={delay}", *arguments]


def race(part, command, content, is_forced, is_delayed):
    """One race; the number of winners."""
    for name in command.output.parent.iterdir():
        name.unlink()
    if is_forced:
        command.output.write_bytes(b"an older file")
    arguments = command.with_options(*(["--force"] if is_forced else []))
    commands = [delayed(part, arguments, command.output) if is_delayed else arguments for _ in range(2)]
    first = start(commands[0])
    with contextlib.suppress(subprocess.TimeoutExpired):
        first.wait(part.random.uniform(0, APART))
    second = start(commands[1])
    done = [end(first), end(second)]
    what = f"{command.name}{' --force' if is_forced else ''}"
    winners = [each for each in done if each.returncode == 0]
    for loser in (each for each in done if each.returncode != 0):
        says = any(reason in loser.stderr for reason in REASONS) and command.output.name in loser.stderr
        part.check(loser.returncode == 1 and says, f"{what}: status {loser.returncode}: {loser.stderr}")
    part.check(len(winners) == 1 or (is_forced and len(winners) == 2), f"{what}: {len(winners)} winners")
    part.check(command.is_whole(content, part.reader), f"{what}: the file is not whole")
    left = leftovers(command.output.parent)
    part.check(not left, f"{what}: left: {left}")
    return len(winners)
