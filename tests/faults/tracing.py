"""System calls of a program, traced and made to fail by strace."""

import re
from dataclasses import dataclass

from common import Skipped, call, need

LINE = re.compile(r"^(?P<thread>\d+) +(?P<name>\w+)\((?P<arguments>.*)\) += (?P<result>-?\d+|\?)(?P<rest>.*)$")
FILE = re.compile(r"^\d+<([^>]*)>")
UNFINISHED = re.compile(r"^(\d+) +(.*?) *<unfinished \.\.\.>$")
RESUMED = re.compile(r"^(\d+) +<\.\.\. \w+ resumed>(.*)$")


@dataclass
class Call:
    """One system call."""

    thread: str
    name: str
    arguments: str
    result: int
    # number of this call among those of the same name in the same thread, from 1
    number: int
    is_injected: bool

    @property
    def file(self):
        """Name of the file that it works on, if its first argument is one that is open."""
        match = FILE.match(self.arguments)
        return match.group(1) if match else ""


def traced(arguments, names, log, inject=None, paths=()):
    """Runs a command under strace: how it ended, and its calls of these names.

    * `inject`: what happens to which call, in the words of strace
    * `paths`: only calls on these files are traced, counted and injected
    """
    options = ["-f", "-y", "-s", "0", "-o", log, "-e", f"trace={','.join(names)}"]
    if not inject or "signal=" not in inject:
        # faster, but with it some versions of strace lose signals
        options.append("--seccomp-bpf")
    for path in paths:
        options += ["-P", path]
    if inject:
        options += ["-e", f"inject={inject}"]
    log.write_text("")
    done = call(["strace", *options, *arguments])
    return done, parse(log.read_text(errors="replace"))


def parse(text):
    """The calls in a log of strace, in the order of their beginnings."""
    begun, lines = {}, []
    for line in text.splitlines():
        if match := UNFINISHED.match(line):
            begun[match.group(1)] = len(lines)
            lines.append(f"{match.group(1)} {match.group(2)}")
        elif match := RESUMED.match(line):
            if match.group(1) in begun:
                lines[begun.pop(match.group(1))] += match.group(2)
        else:
            lines.append(line)
    calls, counts = [], {}
    for line in lines:
        if match := LINE.match(line):
            key = (match["thread"], match["name"])
            counts[key] = counts.get(key, 0) + 1
            result = int(match["result"]) if match["result"] != "?" else -1
            calls.append(Call(*key, match["arguments"], result, counts[key], "INJECTED" in match["rest"]))
    return calls


def need_strace(work):
    """Skips a part where strace cannot trace."""
    need("strace")
    log = work / "strace.log"
    done, calls = traced(["sh", "-c", ": >/dev/null"], ["openat"], log)
    if done.returncode != 0 or not calls:
        raise Skipped(f"strace cannot trace here: {done.stderr.strip()}")
