"""The commands that write files, for the parts that let calls of the system fail."""

from dataclasses import dataclass
from pathlib import Path

from common import TINY, Recording, call

# two chunks, and one that is open at the end
SMALL = ["fig5", "--set", "run.end_time=2"]


@dataclass
class Command:
    """A command that writes one file."""

    name: str
    arguments: list
    output: Path
    status: int = 0
    # exit status when it fails
    failed: int = 1
    # True if it is written as NAME.part, which stays when it fails
    keeps_part: bool = False

    def with_options(self, *options):
        """The arguments with the output and more options."""
        return [*self.arguments, "-o", str(self.output), *options]

    def content(self):
        """Bytes of the output that every run of the command repeats; None without one."""
        if not self.output.exists():
            return None
        return Recording(self.output).masked() if self.output.suffix == ".mcap" else self.output.read_bytes()

    def is_whole(self, content, reader):
        """True if the output is just that of a good run and, if it is a recording, `percuss-read` finds nothing in it."""
        if self.content() != content:
            return False
        if self.output.suffix != ".mcap" or self.name in ("diff", "recover"):
            # the difference of two runs and what is left of one are no complete runs; they are what a good command writes
            return True
        return call([reader, "verify", self.output]).returncode == 0


def prepare(part):
    """The commands in a new folder, `output` in a folder of its own, and the good content of every output."""
    inputs, outputs = part.folder("inputs"), part.folder("outputs")
    run, cut = inputs / "run.mcap", inputs / "cut.mcap"
    whole = part.good(SMALL, run)
    cut.write_bytes(whole.bytes[: whole.chunks()[1][1] + 1000])
    percuss, reader = part.percuss, part.reader
    commands = [
        Command("run", [percuss, "run", *SMALL, "--quiet"], outputs / "run.mcap", keeps_part=True),
        Command("run --sync chunk", [percuss, "run", *SMALL, "--quiet", "--sync", "chunk"], outputs / "run.mcap", keeps_part=True),
        Command("exact", [percuss, "exact", *TINY, "--quiet"], outputs / "exact.mcap", keeps_part=True),
        Command("layout", [percuss, "layout", "fig5"], outputs / "layout.json"),
        Command("trace", [reader, "trace", run, "--topic", "/drag,/probes,/velocity"], outputs / "trace.csv"),
        Command("trace parquet", [reader, "trace", run], outputs / "trace.parquet"),
        Command("plot", [reader, "plot", run], outputs / "plot.svg"),
        Command("plot png", [reader, "plot", run], outputs / "plot.png"),
        Command("export", [reader, "export", run, "--topic", "/field/stress"], outputs / "field.vti"),
        Command("report", [reader, "report", run], outputs / "report.html"),
        Command("recover", [reader, "recover", cut], outputs / "recovered.mcap", status=3),
    ]
    difference = outputs / "difference.mcap"
    commands.append(Difference("diff", [reader, "diff", run, run], difference, failed=2))
    contents = {}
    for command in commands:
        done = call(command.with_options("--force"))
        if done.returncode != command.status:
            raise RuntimeError(f"{command.name}: status {done.returncode}: {done.stderr}")
        contents[command.name] = command.content()
        command.output.unlink()
    return commands, contents


class Difference(Command):
    """`diff`, whose output has an option of its own."""

    def with_options(self, *options):
        return [*self.arguments, "--write-diff", str(self.output), *options]
