"""kill -9 at random instants of a run.

* What is left is a part, never a file of the final name, unless the run was complete.
* Every byte of the part is that of an uninterrupted run, `percuss.host` apart, and every message that an independent reader gets
  out of it is bit for bit the message of that run: no wrong sample.
* Every chunk that is whole in the part is read: no more is lost than the chunk that was open.
* `percuss-read recover` gets the same messages out of it.
* Without `--force` and `--resume` the part is not touched.
* Resumed, if need be several times and on another number of threads, the run gives the messages of the uninterrupted one.
"""

import signal
import statistics
import time

from common import CASE, Recording, call, end, is_prefix, leftovers, part_of, start

CHECKPOINTS = ["--set", "run.checkpoint_every=0.05"]
THREADS = (1, 2, 3, 16)
COMPRESSIONS = ("zstd", "none")
# at this pace a run takes 0.6 s, and its start some time on a busy machine [s]
DURATION = 0.8
PACE = ["--pace", "10"]
# resumed runs that are killed too
KILLED_AGAIN = 0.3


def prove(part):
    """Kills and resumes."""
    wanted = 20 if part.quick else 200
    resumes = "--resume" in call([part.percuss, "run", "--help"]).stdout
    cases = {name: [*CASE, "--set", f"record.compression={name}"] for name in COMPRESSIONS}
    references = {}
    for name, case in cases.items():
        references[name] = part.good(case, part.work / f"{name}.mcap")
    if resumes:
        cases = {name: [*case, *CHECKPOINTS] for name, case in cases.items()}
    kills, again, chunks = 0, 0, []
    while kills < wanted and not len(part.failures) > 20:
        name = part.random.choice(COMPRESSIONS)
        output = part.folder() / "run.mcap"
        status = killed(part, cases[name], output)
        if status == 0:
            part.check(output.is_file(), "a run ends well and has no file")
            continue
        if not part.check(status == -signal.SIGKILL, f"status {status} of a run that is killed"):
            continue
        kills += 1
        what = f"kill {kills} (seed {part.seed})"
        if output.exists():
            # between renaming and the end of the process
            part.check(part.is_sound(output), f"{what}: the final name stands for a broken file")
            continue
        chunks.append(check_part(part, what, references[name], output, resumes))
        if resumes:
            again += resume(part, what, cases[name], output, references[name])
        else:
            begin_anew(part, what, cases[name], output, references[name])
    if not resumes:
        print("kill     SKIPPED in part: this percuss has no `run --resume`; runs are begun anew with --force", flush=True)
    counts = statistics.quantiles(chunks, n=4) if len(chunks) > 1 else chunks
    quartiles = "/".join(f"{count:.0f}" for count in counts)
    return f"{kills} instants, {again} more while resuming, chunks left (quartiles) {quartiles}"


def killed(part, case, output, *options):
    """Starts a run and kills it at a random instant; its status."""
    threads = part.random.choice(THREADS)
    process = start([part.percuss, "run", *case, "-o", output, "--quiet", "--threads", threads, *PACE, *options])
    time.sleep(part.random.uniform(0, DURATION))
    process.kill()
    return end(process).returncode


def check_part(part, what, reference, output, resumes):
    """What a killed run has left; the number of whole chunks."""
    path = part_of(output)
    if not path.exists() or path.stat().st_size < 16:
        return 0
    left = Recording(path)
    wrong = sum(a != b for a, b in zip(left.messages, reference.messages))
    part.check(wrong == 0 and is_prefix(left.messages, reference.messages), f"{what}: {wrong} wrong messages")
    if not resumes:
        # checkpoints end chunks, and the case that is attached has their interval
        part.check(reference.masked().startswith(left.masked()), f"{what}: the part is not the start of the whole file")
        least = reference.messages_within(len(left.bytes))
        part.check(len(left.messages) == least, f"{what}: {len(left.messages)} of {least} messages of whole chunks are read")
    whole = len(left.chunks())
    part.check(len(left.counts) == whole, f"{what}: {len(left.counts)} of {whole} chunks are read: {left.broken}")
    if left.messages:
        recovered = output.with_name("recovered.mcap")
        done = call([part.reader, "recover", path, "-o", recovered])
        # a run that is killed before the renaming has lost nothing
        expected = 3 if left.broken else 0
        if part.check(done.returncode == expected, f"{what}: recover: status {done.returncode}: {done.stderr}"):
            same = Recording(recovered).messages == left.messages
            part.check(same, f"{what}: recover and the independent reader differ")
    return whole


def begin_anew(part, what, case, output, reference):
    """A part is left alone without `--force`, and replaced with it."""
    path = part_of(output)
    before = path.read_bytes() if path.exists() else b""
    if before:
        done = call([part.percuss, "run", *case, "-o", output, "--quiet"])
        refused = done.returncode == 1 and str(path) in done.stderr and "--force" in done.stderr
        part.check(refused, f"{what}: begun without --force: status {done.returncode}: {done.stderr}")
        part.check(path.read_bytes() == before, f"{what}: a run that is refused changes the part")
    call([part.percuss, "run", *case, "-o", output, "--quiet", "--force"])
    part.check(output.is_file() and Recording(output).masked() == reference.masked(), f"{what}: begun anew, it differs")
    part.check(not path.exists(), f"{what}: a part is left of a complete run")


def resume(part, what, case, output, reference):
    """Resumes until the run is complete; the number of kills on the way."""
    again = 0
    while not output.exists() and part.random.random() < KILLED_AGAIN and has_checkpoint(output):
        status = killed(part, case, output, "--resume")
        again += status == -signal.SIGKILL
        part.check(status in (0, -signal.SIGKILL), f"{what}: resumed: status {status}")
    if not output.exists():
        # before the first checkpoint there is nothing to resume from
        option = "--resume" if has_checkpoint(output) else "--force"
        threads = part.random.choice(THREADS)
        done = call([part.percuss, "run", *case, "-o", output, "--quiet", option, "--threads", threads])
        part.check(done.returncode == 0, f"{what}: {option}: status {done.returncode}: {done.stderr}")
    if part.check(output.is_file(), f"{what}: resumed, it has no file"):
        same = Recording(output).messages == reference.messages
        part.check(same, f"{what}: resumed, its messages differ from those of the uninterrupted run")
        part.check(part.is_sound(output), f"{what}: resumed, the file is not sound")
    left = leftovers(output.parent)
    part.check(not left, f"{what}: left after the end: {left}")
    return again


def has_checkpoint(output):
    """True if there is something to resume from."""
    return output.with_name(f"{output.name}.checkpoint").exists()
