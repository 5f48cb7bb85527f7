"""File systems in memory (tmpfs) of many sizes, too small for an output, and such that fill up while it is written.

Every command ends in one of three ways:

* complete: the file is that of a disk with room;
* a run is refused before it begins, because its recording is larger than what is free: there is no file at all;
* it fails with one error that names the file, the cause and the bytes before: there is no file of the final name. A run leaves its part,
  of which every whole chunk is read; others leave nothing.
"""

import re
import time
from collections import Counter

from commands import SMALL, Command
from common import Recording, Skipped, call, end, leftovers, part_of, start

SMALLEST = 64 << 10
# above what is needed
LARGEST = 1.15
# of a run whose disk becomes smaller: it takes half a second
PACE = ["--pace", "4"]


def prove(part):
    """Every command on every size."""
    disk = Disk(part.folder("disk"))
    try:
        return fill(part, disk)
    finally:
        disk.unmount()


class Disk:
    """A file system of a size that can be changed."""

    def __init__(self, folder):
        self.folder = folder
        done = call(["mount", "-t", "tmpfs", "-o", f"size={SMALLEST}", "tmpfs", folder])
        if done.returncode != 0:
            raise Skipped(f"tmpfs cannot be mounted here: {done.stderr.strip()}")

    def resize(self, size):
        """True if the size is now this one, which it cannot be if more is in use [bytes]."""
        return call(["mount", "-o", f"remount,size={size}", self.folder]).returncode == 0

    def empty(self):
        """Removes all files."""
        for name in self.folder.iterdir():
            name.unlink()

    def unmount(self):
        """Gives the memory back."""
        call(["umount", self.folder])


def fill(part, disk):
    """All commands on all sizes; the numbers."""
    source = part.work / "source.mcap"
    whole = part.good(SMALL, source)
    cut = part.work / "cut.mcap"
    cut.write_bytes(whole.bytes[:-1000])
    run = [part.percuss, "run", *SMALL, "--quiet"]
    commands = [
        Command("run zstd", run, disk.folder / "run.mcap", keeps_part=True),
        Command("run none", [*run, "--set", "record.compression=none"], disk.folder / "run.mcap", keeps_part=True),
        Command("trace", [part.reader, "trace", source, "--topic", "/interface/stress"], disk.folder / "trace.csv"),
        Command("recover", [part.reader, "recover", cut], disk.folder / "recovered.mcap", status=3),
    ]
    count, ends = (6 if part.quick else 50), Counter()
    for command in commands:
        disk.resize(1 << 30)
        disk.empty()
        done = call(command.with_options())
        if done.returncode != command.status:
            raise RuntimeError(f"{command.name}: status {done.returncode}: {done.stderr}")
        content, size = command.content(), command.output.stat().st_size
        reference = Recording(command.output) if command.keeps_part else None
        for number in range(count):
            room = int(SMALLEST * (LARGEST * max(size, SMALLEST) / SMALLEST) ** (number / (count - 1)))
            for shrinks in (False, True) if command.keeps_part else (False,):
                done = shrinking(disk, command, room) if shrinks else within(disk, command, room)
                what = f"{command.name}, {room} bytes{', shrinking' if shrinks else ''}"
                ends[check(part, what, command, done, content, reference)] += 1
    part.check(all(ends[kind] for kind in ("complete", "refused", "failed")), f"not all ends occur: {dict(ends)}")
    return f"{count} sizes, {', '.join(f'{number} {kind}' for kind, number in ends.items())}"


def within(disk, command, room):
    """Runs a command on a file system of this size."""
    disk.empty()
    disk.resize(room)
    return call(command.with_options())


def shrinking(disk, command, room):
    """Runs a command on a file system that has room at first."""
    disk.empty()
    disk.resize(1 << 30)
    process = start([*command.with_options(), *PACE])
    while process.poll() is None and not part_of(command.output).exists():
        time.sleep(0.002)
    disk.resize(room)
    return end(process)


def check(part, what, command, done, content, reference):
    """How a command has ended: complete, refused or failed."""
    part.check_unbroken(done, what)
    left = leftovers(command.output.parent)
    if done.returncode == command.status:
        part.check(command.content() == content, f"{what}: another file than with room")
        part.check(not left, f"{what}: left: {left}")
        return "complete"
    text = re.sub(r"\s+", " ", done.stderr)
    what = f"{what}: status {done.returncode}: {text}"
    errors = len(re.findall(r"^error: ", done.stderr, re.MULTILINE))
    part.check(done.returncode == 1 and errors == 1 and command.output.name in text, f"{what}: not one clear error")
    part.check(not command.output.exists(), f"{what}: the final name is there")
    if "would take about" in text:
        part.check(not left, f"{what}: left: {left}")
        return "refused"
    bytes_before = re.search(r"after (\d+) bytes", text)
    part.check("No space left on device" in text and bytes_before, f"{what}: cause and bytes?")
    if not command.keeps_part:
        part.check(not left, f"{what}: left: {left}")
        return "failed"
    if part.check(left == [part_of(command.output).name], f"{what}: left: {left}"):
        found = Recording(part_of(command.output))
        least = reference.messages_within(len(found.bytes))
        sound = found.messages == reference.messages[: len(found.messages)] and len(found.messages) >= least
        part.check(sound, f"{what}: {len(found.messages)} messages are read, {least} are in whole chunks")
    return "failed"
