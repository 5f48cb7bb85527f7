"""What the parts share: programs, checks, cases, and what recordings hold by an independent reader."""

import os
import random
import shutil
import struct
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from mcap.records import Chunk, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk

# a second of work on a busy machine is far from this [s]
LONGEST = 120
MAGIC = b"\x89MCAP0\r\n"
# records of MCAP
CHUNK, MESSAGE_INDEX, METADATA, DATA_END = 0x06, 0x07, 0x0C, 0x0F
RECORD_HEADER = 9
# how a program of Rust ends that has panicked or aborted
PANICKED = (101, -6, -11, 134, 139)

# 300 steps, seven chunks, 10 MB
CASE = ["fig5"]
# 20 steps, one chunk, less than 100 kB
TINY = ["fig5", "--set", "mesh.cells=20", "--set", "run.end_time=2", "--set", "record.frames=3"]


class Skipped(Exception):
    """This machine cannot run a part, and why."""


class Programs:
    """The two programs in a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.percuss = str(folder / "percuss")
        self.reader = str(folder / "percuss-read")


@dataclass
class Part:
    """A part of the test: what it works with, and what it has found."""

    name: str
    programs: list
    work: Path
    quick: bool
    seed: int
    checks: int = 0
    failures: list = field(default_factory=list)

    def __post_init__(self):
        self.random = random.Random(self.seed)
        self.percuss, self.reader = self.programs[0].percuss, self.programs[0].reader

    def check(self, condition, message):
        """Counts a check, and notes a failure."""
        self.checks += 1
        if not condition:
            self.failures.append(message)
        return bool(condition)

    def folder(self, name="files"):
        """An empty folder of this name."""
        folder = self.work / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        return folder

    def good(self, case, path):
        """Runs a case into `path` without any fault: what others are compared with."""
        done = call([self.percuss, "run", *case, "-o", path, "--quiet", "--force"])
        if done.returncode != 0:
            raise RuntimeError(f"percuss run {' '.join(case)}: status {done.returncode}: {done.stderr}")
        return Recording(path)

    def is_sound(self, path):
        """True if `percuss-read verify` finds nothing in a recording."""
        return call([self.reader, "verify", path]).returncode == 0

    def check_unbroken(self, done, what):
        """The program has neither panicked nor been stuck."""
        panicked = done.returncode in PANICKED or "panicked at" in done.stderr
        self.check(not panicked and done.returncode is not None, f"{what}: status {done.returncode}: {done.stderr}")


def call(arguments, **options):
    """Runs a command to its end; its status is None if it does not end."""
    arguments = [str(argument) for argument in arguments]
    options = {"stdin": subprocess.DEVNULL, "capture_output": True, "timeout": LONGEST, **options}
    try:
        done = subprocess.run(arguments, check=False, **options)
    except subprocess.TimeoutExpired as expired:
        return subprocess.CompletedProcess(arguments, None, "", f"still running after {expired.timeout} s")
    for name in ("stdout", "stderr"):
        setattr(done, name, (getattr(done, name) or b"").decode(errors="replace"))
    return done


def start(arguments, **options):
    """Starts a command."""
    options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, **options}
    return subprocess.Popen([str(argument) for argument in arguments], **options)


def end(process, timeout=LONGEST):
    """Waits for a command that was started."""
    try:
        _, stderr = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return subprocess.CompletedProcess(process.args, None, "", f"still running after {timeout} s")
    return subprocess.CompletedProcess(process.args, process.returncode, "", (stderr or b"").decode(errors="replace"))


def need(*commands):
    """Skips a part for want of a command."""
    for command in commands:
        if shutil.which(command) is None:
            raise Skipped(f"{command} is not installed")


def compiled(source, target, *options):
    """Compiles a C file beside this one."""
    need("cc")
    source = Path(__file__).with_name(source)
    done = call(["cc", "-O1", "-Wall", "-Werror", "-o", target, source, *options])
    if done.returncode != 0:
        raise Skipped(f"cc {source.name}: {done.stderr.strip()}")
    return target


class Recording:
    """What is readable in a file, from its start to where it breaks off."""

    def __init__(self, path):
        self.bytes = Path(path).read_bytes()
        self.messages, self.metadata, self.broken = [], {}, None
        # messages of every chunk
        self.counts = []
        topics = {}
        with open(path, "rb") as stream:
            records = StreamReader(stream, emit_chunks=True, validate_crcs=True).records
            while True:
                try:
                    record = next(records)
                    found = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
                except StopIteration:
                    break
                # whatever the library raises at a cut record
                except Exception as error:
                    self.broken = f"{type(error).__name__}: {error}"
                    break
                if isinstance(record, Chunk):
                    self.counts.append(sum(isinstance(each, Message) for each in found))
                for each in found:
                    if isinstance(each, Metadata):
                        self.metadata[each.name] = each.metadata
                    elif hasattr(each, "topic"):
                        topics[each.id] = each.topic
                    elif isinstance(each, Message):
                        times = (each.log_time, each.publish_time)
                        self.messages.append((topics[each.channel_id], each.sequence, *times, each.data))

    @property
    def status(self):
        """What its status record says; None without one."""
        return self.metadata.get("percuss.status", {}).get("status")

    def records(self):
        """Opcode, start and end of every whole record outside chunks."""
        offset = len(MAGIC)
        while offset + RECORD_HEADER <= len(self.bytes):
            opcode, length = struct.unpack_from("<BQ", self.bytes, offset)
            if offset + RECORD_HEADER + length > len(self.bytes):
                return
            yield opcode, offset, offset + RECORD_HEADER + length
            offset += RECORD_HEADER + length

    def masked(self):
        """Its bytes with zeros for `percuss.host` and for the checksum of the data section, which is also over that record."""
        masked = bytearray(self.bytes)
        for opcode, begin, finish in self.records():
            is_host = opcode == METADATA and b"percuss.host" in self.bytes[begin : begin + RECORD_HEADER + 16]
            if is_host or opcode == DATA_END:
                masked[begin + RECORD_HEADER : finish] = bytes(finish - begin - RECORD_HEADER)
        return bytes(masked)

    def chunks(self):
        """Of every chunk, where it ends, and where the indexes after it end."""
        chunks = []
        for opcode, _, finish in self.records():
            if opcode == CHUNK:
                chunks.append((finish, finish))
            elif opcode == MESSAGE_INDEX:
                chunks[-1] = (chunks[-1][0], finish)
        return chunks

    def messages_within(self, size):
        """Number of messages in the chunks that are whole in the first `size` bytes."""
        return sum(count for (finish, _), count in zip(self.chunks(), self.counts) if finish <= size)


def is_prefix(start_of, whole):
    """True if a list is the start of another."""
    return whole[: len(start_of)] == start_of


def part_of(path):
    """Name of a recording as long as it is written."""
    return Path(f"{path}.part")


def leftovers(folder):
    """Names of unfinished files in a folder."""
    return sorted(name for name in os.listdir(folder) if name.endswith((".part", ".new", ".checkpoint")))
