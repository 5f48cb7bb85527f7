"""What is on the disk, and when: the order of writes, synchronisations and renamings, as strace sees it.

* `run --sync chunk`: after every chunk with its indexes the file is synchronised before its next byte is written. So a power failure at
  any time leaves a file of which every chunk that was closed before is on the disk, and can be read.
* `run --sync end`, and every other command that writes a file: all of it is synchronised before it gets its name, and its folder after.
* `run --sync never`: nothing is synchronised.
"""

from commands import prepare
from common import CASE, Recording, part_of
from tracing import need_strace, traced

NAMES = ["write", "pwrite64", "writev", "fsync", "fdatasync", "rename", "renameat", "renameat2", "linkat"]


def prove(part):
    """All three ways of a run, then the other commands."""
    need_strace(part.work)
    synced = {when: order_of_run(part, when) for when in ("chunk", "end", "never")}
    commands, _ = prepare(part)
    for command in commands:
        done, calls = traced(command.with_options(), NAMES, part.work / "strace.log")
        part.check(done.returncode == command.status, f"{command.name}: status {done.returncode}: {done.stderr}")
        check_end(part, command.name, calls, command.output)
        command.output.unlink(missing_ok=True)
    counts = ", ".join(f"{count} with --sync {when}" for when, count in synced.items())
    return f"synchronisations of a run of seven chunks: {counts}; {len(commands)} commands"


def order_of_run(part, when):
    """Checks the calls of a run; how often it has synchronised its file."""
    output = part.folder() / "run.mcap"
    arguments = [part.percuss, "run", *CASE, "--quiet", "--sync", when, "-o", output]
    done, calls = traced(arguments, NAMES, part.work / "strace.log")
    what = f"run --sync {when}"
    part.check(done.returncode == 0, f"{what}: status {done.returncode}: {done.stderr}")
    recording = Recording(output)
    ends = [finish for _, finish in recording.chunks()]
    part.check(len(ends) > 5, f"{what}: only {len(ends)} chunks")
    synced = is_synced = 0
    written, durable, before = 0, [], {}
    for call in calls:
        if call.file != str(part_of(output)):
            continue
        if call.name == "write":
            before[written] = is_synced
            crossed = [finish for finish in ends[:-1] if written < finish < written + call.result]
            part.check(when != "chunk" or not crossed, f"{what}: a write continues from chunk to chunk, at {crossed}")
            written, is_synced = written + call.result, False
        elif call.name in ("fsync", "fdatasync"):
            synced, is_synced = synced + 1, True
            durable.append(written)
    part.check(written == len(recording.bytes), f"{what}: {written} bytes are written of {len(recording.bytes)}")
    if when == "chunk":
        for number, finish in enumerate(ends[:-1]):
            part.check(before.get(finish), f"{what}: chunk {number} is not synchronised before the next byte")
        after_power_loss(part, what, recording, durable)
    if when == "never":
        part.check(synced == 0, f"{what}: synchronised {synced} times")
    else:
        check_end(part, what, calls, output)
    return synced


def after_power_loss(part, what, recording, durable):
    """Reads what is on the disk after each synchronisation."""
    path = part.work / "durable.mcap"
    for size in durable:
        path.write_bytes(recording.bytes[:size])
        found, least = Recording(path).messages, recording.messages_within(size)
        fine = len(found) == least and found == recording.messages[:least]
        part.check(fine, f"{what}: of the first {size} bytes {len(found)} messages are read, {least} are in them")


def check_end(part, what, calls, output):
    """The file is synchronised after its last write and before it gets its name, its folder after."""
    names = [number for number, call in enumerate(calls) if call.name.startswith(("rename", "link")) and call.result == 0]
    names = [number for number in names if f'"{output}"' in calls[number].arguments]
    if not part.check(len(names) == 1, f"{what}: renamed {len(names)} times"):
        return
    named = names[0]
    folder = str(output.parent)
    unfinished = {call.file for call in calls[:named] if call.name == "write" and call.file.startswith(f"{folder}/")}
    part.check(len(unfinished) == 1, f"{what}: writes to {unfinished}")
    last_write = max((number for number, call in enumerate(calls) if call.name == "write" and call.file in unfinished), default=0)
    syncs = [number for number, call in enumerate(calls) if call.name in ("fsync", "fdatasync") and call.result == 0]
    is_whole = any(last_write < number < named and calls[number].file in unfinished for number in syncs)
    part.check(is_whole and last_write < named, f"{what}: not synchronised before it gets its name")
    part.check(any(number > named and calls[number].file == folder for number in syncs), f"{what}: its folder is not")
