"""Every call of a run with checkpoints that writes, synchronises, renames or creates a file, made to fail; and those of its resumption.

A run of eight steps writes checkpoints as often as it can. As in `calls`, each of its calls fails, is interrupted, or is the last before
kill -9. What is left is resumed by `run --resume`, begun anew if there was no checkpoint yet, and gives the messages of the
uninterrupted run. The same for the calls of a resumption: if it fails, the next one succeeds.
"""

import shutil
import signal

from calls import FAULTS, NAMES, TEXTS
from common import Recording, Skipped, call, leftovers, part_of
from tracing import need_strace, traced

CASE = ["fig5", "--set", "mesh.cells=20", "--set", "run.end_time=0.8", "--set", "record.frames=3"]
CHECKPOINTS = ["--set", "run.checkpoint_every=1e-9"]
# faults of the quick test
QUICK = 24


def prove(part):
    """Faults while a run writes, then while it resumes."""
    if "--resume" not in call([part.percuss, "run", "--help"]).stdout:
        raise Skipped("this percuss has no `run --resume`")
    need_strace(part.work)
    reference = part.good(CASE, part.work / "reference.mcap")
    folder = part.folder()
    run = [part.percuss, "run", *CASE, *CHECKPOINTS, "--quiet", "-o", folder / "run.mcap"]
    subject = Subject(part, folder, run, reference)
    first = subject.prove_all([], None)
    # the state in the middle of the run
    middle = part.folder("middle")
    subject.stop_in_the_middle(middle)
    second = subject.prove_all(["--resume"], middle)
    return f"{first} faults of a run, {second} of its resumption, {subject.resumed} resumed after them"


class Subject:
    """A run with checkpoints in a folder."""

    def __init__(self, part, folder, run, reference):
        self.part, self.folder, self.command, self.reference = part, folder, run, reference
        self.output = folder / "run.mcap"
        self.resumed = 0

    def place(self, state):
        """Empties the folder, or puts into it what another has."""
        shutil.rmtree(self.folder)
        shutil.copytree(state, self.folder) if state else self.folder.mkdir()

    def trace(self, options, inject=None):
        """A traced run. Openings of other files by the loader are left out: their number is not that of ours."""
        paths = [self.output, part_of(self.output), f"{part_of(self.output)}.new", self.folder]
        paths = paths if inject and inject.startswith("openat") else ()
        return traced([*self.command, *options], NAMES, self.part.work / "strace.log", inject, paths)

    def targets(self, options, state):
        """Name and number of every call on a file of the run."""
        self.place(state)
        done, calls = self.trace(options)
        self.part.check(done.returncode == 0, f"{options} traced: status {done.returncode}: {done.stderr}")
        ours = [each for each in calls if each.name != "openat" and str(self.folder) in each.file + each.arguments]
        found = {(each.name, each.number) for each in ours}
        self.place(state)
        _, calls = self.trace(options, "openat:error=EIO:when=10000")
        return sorted(found | {(each.name, each.number) for each in calls if "O_CREAT" in each.arguments})

    def prove_all(self, options, state):
        """Every fault of every call; their number."""
        chosen = [(name, number, fault) for name, number in self.targets(options, state) for fault in FAULTS]
        self.part.check(len(chosen) > 20, f"{options}: only {chosen} are traced")
        if self.part.quick:
            chosen = self.part.random.sample(chosen, min(QUICK, len(chosen)))
        return sum(self.attempt(options, state, *each) for each in chosen)

    def attempt(self, options, state, name, number, fault):
        """One fault, and what comes after it; 1 if it hit a call."""
        what = " ".join(["run", *options, f"{name} {number}, {fault}"])
        self.place(state)
        done, calls = self.trace(options, f"{name}:{FAULTS[fault]}:when={number}")
        is_killed = done.returncode == -signal.SIGKILL
        if not is_killed and not any(each.is_injected for each in calls):
            return 0
        self.part.check_unbroken(done, what) if not is_killed else None
        if fault == "EINTR":
            self.part.check(done.returncode == 0, f"{what}: status {done.returncode}: {done.stderr}")
        elif not is_killed and done.returncode != 0:
            # a fault of the n-th write of every thread may be that of the message itself
            is_lost = any(each.is_injected and str(self.folder) not in each.file + each.arguments for each in calls)
            named = is_lost or (self.output.name in done.stderr and TEXTS.get(fault, "") in done.stderr)
            self.part.check(done.returncode == 1 and named, f"{what}: status {done.returncode}: {done.stderr}")
        if not self.output.exists():
            self.finish(what, state)
        same = self.output.exists() and Recording(self.output).messages == self.reference.messages
        self.part.check(same, f"{what}: the messages differ from those of the uninterrupted run")
        self.part.check(self.part.is_sound(self.output), f"{what}: the file is not sound")
        return 1

    def finish(self, what, state):
        """Resumes what is left, or begins it anew if there is no checkpoint."""
        has_checkpoint = self.output.with_name(f"{self.output.name}.checkpoint").exists()
        self.part.check(has_checkpoint or not state, f"{what}: the checkpoint is gone")
        done = call([*self.command, "--resume" if has_checkpoint else "--force"])
        self.part.check(done.returncode == 0, f"{what}: then: status {done.returncode}: {done.stderr}")
        left = leftovers(self.folder)
        self.part.check(not left, f"{what}: left after the end: {left}")
        self.resumed += 1

    def stop_in_the_middle(self, folder):
        """Keeps what a run leaves that is killed while it writes a checkpoint that is not its first."""
        renamings = [target for target in self.targets([], None) if target[0].startswith("rename")]
        name, number = renamings[len(renamings) // 2]
        self.place(None)
        self.trace([], f"{name}:signal=KILL:when={number}")
        shutil.rmtree(folder)
        shutil.copytree(self.folder, folder)
        # an unfinished checkpoint is a matter of the run, which is proved before
        for unfinished in folder.glob("*.checkpoint.*part"):
            unfinished.unlink()
