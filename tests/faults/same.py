"""One case, one recording: its bytes do not depend on where, when, by whom and on how many threads it is computed.

Every variant is compared byte by byte with a run of one thread, but for the record `percuss.host` and the checksum of the data section,
which is also over that record. Vector widths are chosen by qemu, which runs the programs as on another processor: the program
`width.c` shows that they are what they should be. Then come runs of 16 threads on two cores under load.
"""

import contextlib
import multiprocessing
import os

from commands import SMALL
from common import Recording, Skipped, call, compiled, need

CASES = {
    "flat": SMALL,
    "elastic": ["elastic-fig2", "--set", "mesh.cells=20", "--set", "run.end_time=1", "--set", "record.frames=10"],
    "ball": ["ball", "--set", "mesh.cells=12", "--set", "run.end_time=20 us", "--set", "record.frames=10"],
}
PROCESSORS = {"Nehalem": "128", "max": "256"}
THREADS = (2, 3, 5, 16, 64)
LOADED_THREADS = 16


def prove(part):
    """All variants of all cases, then one case under load."""
    references = {}
    for name, case in CASES.items():
        path = part.work / f"{name}.mcap"
        done = call([part.percuss, "run", *case, "-o", path, "--threads", 1])
        if done.returncode != 0:
            raise RuntimeError(f"{name}: {done.stderr}")
        references[name] = Recording(path).masked()
    chosen, widths = variants(part)
    for name, case in CASES.items():
        for what, before, options, settings in chosen:
            compare(part, f"{name}, {what}", [*before, part.percuss, "run", *case, *options], references[name], **settings)
        for other in part.programs[1:]:
            compare(part, f"{name}, {other.folder}", [other.percuss, "run", *case], references[name])
    times = 10 if part.quick else 200
    with load():
        for _ in range(times):
            arguments = [part.percuss, "run", *SMALL, "--threads", LOADED_THREADS]
            compare(part, "under load", arguments, references["flat"], preexec_fn=two_cores)
    builds = f"{len(part.programs)} builds" if len(part.programs) > 1 else "1 build (others: give their folders too)"
    return f"{len(CASES)} cases, {len(chosen)} variants, vectors of {widths} bits, {builds}, {times} runs under load"


def variants(part):
    """Name, what stands before the program, options and settings of the process; and the vector widths that they cover."""
    there = part.folder("Über uns, 100 %")
    found = [(f"{threads} threads", [], ["--threads", threads], {}) for threads in THREADS]
    found += [(f"--sync {when}", [], ["--sync", when], {}) for when in ("chunk", "never")]
    found += [(f"TZ={zone}", [], [], environment(TZ=zone)) for zone in ("Asia/Kathmandu", "America/St_Johns", "nowhere")]
    found += [(f"LC_ALL={name}", [], [], environment(LC_ALL=name, LANG=name)) for name in ("de_DE.UTF-8", "tr_TR", "C")]
    found += [
        ("another folder", [], [], {"cwd": there}),
        ("no environment", [], [], {"env": {}}),
        ("memory that is not zero", [], [], environment(MALLOC_PERTURB_="165")),
        ("quiet", [], ["--quiet"], {}),
        ("no group rights", [], [], {"umask": 0o077}),
    ]
    with contextlib.suppress(Skipped):
        need("setarch")
        found.append(("addresses that are not random", ["setarch", "-R"], [], {}))
    try:
        need("faketime")
        found += [(f"clock {shift}", ["faketime", "-f", shift], [], {}) for shift in ("+1y", "-1y")]
    except Skipped as reason:
        print(f"same     SKIPPED in part: other clocks: {reason}", flush=True)
    widths = []
    try:
        need("qemu-x86_64")
        program = compiled("width.c", part.work / "width")
        widths.append(call([program]).stdout.strip())
        for processor, width in PROCESSORS.items():
            emulator = ["qemu-x86_64", "-cpu", processor]
            found_width = call([*emulator, program]).stdout.strip()
            part.check(found_width == width, f"processor {processor}: vectors of {found_width} bits")
            widths.append(found_width)
            found.append((f"processor {processor}", emulator, ["--threads", 2], {}))
    except Skipped as reason:
        print(f"same     SKIPPED in part: other vector widths: {reason}", flush=True)
    return found, "/".join(sorted(set(widths))) or "one number of"


def environment(**changes):
    """Settings of a process with other variables."""
    return {"env": {**os.environ, **changes}}


def compare(part, what, arguments, reference, **settings):
    """Runs a variant and compares its recording."""
    path = part.folder() / "any name.mcap"
    done = call([*arguments, "-o", path], **settings)
    if part.check(done.returncode == 0, f"{what}: status {done.returncode}: {done.stderr}"):
        part.check(Recording(path).masked() == reference, f"{what}: the recording differs")


def two_cores():
    """Binds a process to two cores."""
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])


def burn():
    """Keeps a core busy."""
    two_cores()
    while True:
        pass


@contextlib.contextmanager
def load():
    """Two busy processes on the two cores."""
    busy = [multiprocessing.Process(target=burn, daemon=True) for _ in range(2)]
    for process in busy:
        process.start()
    try:
        yield
    finally:
        for process in busy:
            process.terminate()
            process.join()
