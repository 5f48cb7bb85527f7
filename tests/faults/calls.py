"""Every call that writes, synchronises, renames or creates an output, made to fail one after the other.

A clean run under strace counts the calls on the folder of the output. Then each of them, by its number, fails with EIO and with
ENOSPC, is interrupted (EINTR), and is the last before kill -9; without a file of the final name, and with an older one that
is replaced (`--force`).

* The final name stands for nothing, for the older file, or for the whole new one: never for anything else.
* A call that fails gives exit status 1 (`diff`: 2, could not compare) and a message with the path and the cause; one that is
  interrupted is repeated.
* What fails leaves no unfinished file but `NAME.part` of a recording, whose messages are the first of the run.
* A file system that cannot rename without replacing (ENOSYS, EINVAL) gives the file all the same.
"""

import re
import signal

from commands import prepare
from common import Recording, is_prefix, leftovers, part_of
from tracing import need_strace, traced

NAMES = ["write", "pwrite64", "writev", "fsync", "fdatasync", "openat", "rename", "renameat", "renameat2", "linkat"]
FAULTS = {"EIO": "error=EIO", "ENOSPC": "error=ENOSPC", "EINTR": "error=EINTR", "KILL": "signal=KILL"}
TEXTS = {"EIO": "Input/output error", "ENOSPC": "No space left on device"}
# how often a call can fail in the quick test: of the many writes, some
MOST_WRITES = 4
OLD = b"an older file"


def prove(part):
    """Every command, every call, every fault."""
    need_strace(part.work)
    commands, contents = prepare(part)
    counts, missed = dict.fromkeys(FAULTS, 0), 0
    reference = Recording(part.work / "inputs" / "run.mcap")
    for command in commands:
        # the quick test takes one of both
        for is_forced in [part.random.choice((False, True))] if part.quick else (False, True):
            targets = targets_of(part, command, is_forced)
            for name, number in targets:
                for fault in chosen_faults(part, name):
                    attempt = Attempt(part, command, contents[command.name], is_forced, name, number, fault)
                    hits = attempt.run(reference)
                    counts[fault] += hits
                    missed += 1 - hits
        rename_otherwise(part, command, contents[command.name])
    # threads divide their calls differently from run to run: some attempts have fewer than the clean run
    part.check(missed < 0.1 * sum(counts.values()), f"{missed} attempts have hit no call")
    return f"{len(commands)} commands, {', '.join(f'{count} {name}' for name, count in counts.items())}, {missed} missed"


def chosen_faults(part, name):
    """All faults; in the quick test two, changing from call to call."""
    names = list(FAULTS)
    return part.random.sample(names, 2) if part.quick and name == "write" else names


def paths_of(command):
    """Files by which strace selects the calls; none where the name of the unfinished file is random."""
    if not command.keeps_part:
        return ()
    return (command.output, part_of(command.output), command.output.parent)


def arguments_of(command, is_forced):
    """The command, and an older file that it is to replace."""
    for left in command.output.parent.iterdir():
        left.unlink()
    if is_forced:
        command.output.write_bytes(OLD)
    return command.with_options(*(["--force"] if is_forced else []))


def is_ours(call, command):
    """True for a call on the output, its unfinished file, or their folder."""
    folder = str(command.output.parent)
    if call.name == "openat":
        return folder in call.arguments and ("O_CREAT" in call.arguments or f'"{folder}"' in call.arguments)
    if call.name.startswith(("rename", "link")):
        return folder in call.arguments
    return call.file.startswith(folder)


def targets_of(part, command, is_forced):
    """Name and number of every call on the output in a clean run."""
    log = part.work / "strace.log"
    done, calls = traced(arguments_of(command, is_forced), NAMES, log, paths=paths_of(command))
    part.check(done.returncode == command.status, f"{command.name} traced: status {done.returncode}: {done.stderr}")
    found = sorted({(call.name, call.number) for call in calls if is_ours(call, command)})
    part.check(len(found) > 3, f"{command.name}: only {found} are traced")
    writes = [target for target in found if target[0] == "write"]
    if part.quick and len(writes) > MOST_WRITES:
        chosen = {writes[0], writes[-1], *part.random.sample(writes, MOST_WRITES - 2)}
        found = [target for target in found if target[0] != "write" or target in chosen]
    return found


class Attempt:
    """One run of a command with one fault."""

    def __init__(self, part, command, content, is_forced, name, number, fault):
        self.part, self.command, self.content, self.is_forced = part, command, content, is_forced
        self.name, self.number, self.fault = name, number, fault
        force = " --force" if is_forced else ""
        self.what = f"{command.name}{force}, {name} {number}, {fault}"

    def run(self, reference):
        """Runs and checks; 1 if a call was hit, else 0."""
        inject = f"{self.name}:{FAULTS[self.fault]}:when={self.number}"
        arguments = arguments_of(self.command, self.is_forced)
        log = self.part.work / "strace.log"
        done, calls = traced(arguments, NAMES, log, inject, paths_of(self.command))
        hit = [call for call in calls if call.is_injected] if self.fault != "KILL" else []
        strange = [call for call in hit if not is_ours(call, self.command)]
        if not self.part.check(not strange, f"{self.what}: it hit {strange}"):
            return 0
        if self.fault == "KILL":
            if done.returncode == self.command.status:
                return 0
            self.part.check(done.returncode == -signal.SIGKILL, f"{self.what}: status {done.returncode}: {done.stderr}")
        elif not hit:
            return 0
        self.part.check_unbroken(done, self.what)
        self.check_final_name()
        if self.fault == "EINTR":
            self.part.check(done.returncode == self.command.status, f"{self.what}: status {done.returncode}: {done.stderr}")
        elif self.fault != "KILL":
            self.check_error(done, hit)
        self.check_rest(reference)
        return 1

    def check_final_name(self):
        """The final name stands for a good file, the older one or none."""
        output = self.command.output
        if not output.exists():
            fine = not self.is_forced and self.fault != "EINTR"
        elif output.read_bytes() == OLD:
            fine = self.is_forced and self.fault != "EINTR"
        else:
            fine = self.command.is_whole(self.content, self.part.reader)
        self.part.check(fine, f"{self.what}: `{output.name}` is not what it may be")

    def check_error(self, done, hit):
        """Status and message of a call that fails."""
        if all(call.name == "openat" and "O_CREAT" not in call.arguments for call in hit):
            # a folder that cannot be opened is not synchronised: left to the system
            self.part.check(done.returncode == self.command.status, f"{self.what}: status {done.returncode}: {done.stderr}")
            return
        stderr = re.sub(r"\s+", " ", done.stderr)
        text = f"{self.what}: status {done.returncode}: {done.stderr}"
        self.part.check(done.returncode == self.command.failed, text)
        self.part.check(self.command.output.name in stderr and TEXTS[self.fault] in stderr, f"{text}: path and cause?")

    def check_rest(self, reference):
        """What else is in the folder of the output."""
        left = leftovers(self.command.output.parent)
        if self.command.keeps_part:
            part_name = part_of(self.command.output)
            self.part.check(left in ([], [part_name.name]), f"{self.what}: left: {left}")
            if left and self.command.name.startswith("run") and part_name.stat().st_size > 0:
                messages = Recording(part_name).messages
                self.part.check(is_prefix(messages, reference.messages), f"{self.what}: the part has wrong messages")
        elif self.fault != "KILL":
            self.part.check(not left, f"{self.what}: left: {left}")


def rename_otherwise(part, command, content):
    """A file system, or a kernel, without renaming that does not replace."""
    for error in ("ENOSYS", "EINVAL"):
        what = f"{command.name}, renameat2, {error}"
        arguments = arguments_of(command, False)
        done, calls = traced(arguments, NAMES, part.work / "strace.log", f"renameat2:error={error}")
        part.check(any(call.is_injected for call in calls), f"{what}: it is not called")
        part.check(done.returncode == command.status, f"{what}: status {done.returncode}: {done.stderr}")
        part.check(command.is_whole(content, part.reader), f"{what}: another file")
        left = leftovers(command.output.parent)
        part.check(not left, f"{what}: left: {left}")
