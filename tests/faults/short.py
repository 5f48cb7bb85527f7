"""Writes that write less than they are asked to, and are interrupted: every command gives the same file as without.

The library `short_write.c` is loaded before that of C, whose `write` the programs call. It counts what it does: a program
that it does not reach, for example one that is linked statically, fails the part.
"""

import os

from commands import prepare
from common import call, compiled, leftovers


def prove(part):
    """Runs every command with both kinds of short writes."""
    library = compiled("short_write.c", part.work / "short_write.so", "-shared", "-fPIC")
    commands, contents = prepare(part)
    shortened = 0
    for command in commands:
        for mode in ("half", "random"):
            what = f"{command.name}, {mode}"
            count = part.work / "count"
            count.write_text("")
            settings = {"LD_PRELOAD": str(library), "SHORT_WRITE": mode, "SHORT_WRITE_COUNT": str(count)}
            done = call(command.with_options(), env={**os.environ, **settings})
            part.check(done.returncode == command.status, f"{what}: status {done.returncode}: {done.stderr}")
            part.check(command.is_whole(contents[command.name], part.reader), f"{what}: another file than without")
            calls = sum(int(line) for line in count.read_text().split())
            part.check(calls > 0, f"{what}: no write was short")
            shortened += calls
            left = leftovers(command.output.parent)
            part.check(not left, f"{what}: left: {left}")
            command.output.unlink(missing_ok=True)
    return f"{len(commands)} commands, {shortened} short writes"
