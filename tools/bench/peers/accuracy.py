#!/usr/bin/env python3
"""Time to accuracy: how many seconds it takes to have a result right to 1e-2, 1e-3, 1e-4.

    accuracy.py [--task NAME ...] [--threads K] [--rounds R] [--largest N]

Needs `cargo build --release`, gcc and numpy (see --python); for the full theory CalculiX, `ccx` (see calculix.py); for the ball scikit-fem.

Tasks: "axis", the stress on the axis of Fig. 5 between two fronts, beside the finest mesh of the default scheme; "punch", the drag of the plane flat
punch until a wave has crossed it, beside the closed form; "paraboloid", the stress on the axis under the paraboloid of Eq. 16 with prescribed
motion, away from fronts, beside the closed form. "elastic-punch" and "elastic-paraboloid" are the last two in the full theory. "ball", the peak
force and the contact time of a steel ball on aluminium (see graded.py), on meshes of equal grading, of percuss and of finite elements, in CPU seconds of one
thread: of percuss those of the whole process, of the elements those of the steps and those of the assembly too.

Meshes get finer by √2. A scheme has reached an accuracy on the first mesh from which on no rms error is larger; the last column says how far it
came. percuss is timed as a whole process that records every step, without frames. A plain C sweep of the paper's scheme has the numbers of
percuss on the paper's mesh; its time is the mesh and the steps of that over what plain.c does per second on a punch with as many nodes per length.
"""

import argparse
import bisect
import csv
import io
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
RELEASE = HERE.parents[2] / "target" / "release"
TOLERANCES = [1e-2, 1e-3, 1e-4]
LADDER = [12, 17, 25, 35, 50, 70, 100, 140, 200, 280, 400, 560, 800]
PAPER = ["mesh.kind=paper"]
ORDER_2 = ["mesh.order=2"]
FULL = ["model=elastic"]


REFERENCE = 200


def fronts(t, n):
    """True away from the arrivals of waves that have crossed the layer, t = 2m."""
    return abs(t - 2 * round(t / 2)) > 2.5 / min(n, REFERENCE)


# case, settings, topic and field, times that count, schemes
TASKS = {
    "axis": ("fig5", ["run.end_time=3.9"], "/probes", "stress[0]", lambda t, n: 3.2 < t < 3.9),
    "punch": ("fig5-plane", ["run.end_time=1.9"], "/drag", "force", lambda t, n: 0.2 < t < 1.9),
    "paraboloid": ("fig2-prescribed", ["run.end_time=5.5"], "/interface/stress", "stress@r=0", fronts),
    "elastic-punch": ("fig5-plane", [*FULL, "run.end_time=1.9"], "/drag", "force", lambda t, n: 0.2 < t < 1.9),
    "elastic-paraboloid": ("elastic-fig2-prescribed", ["run.end_time=5.5"], "/interface/stress", "stress@r=0", fronts),
}


def percuss(command, task, settings, n, threads, path):
    case, shared, *_ = TASKS[task]
    options = [*shared, *settings, f"mesh.cells={n}", "record.frames=0"]
    options = [part for setting in options for part in ("--set", setting)]
    start = time.perf_counter()
    subprocess.run([RELEASE / "percuss", command, case, *options, "--threads", str(threads), "-o", path, "--force", "-q"], check=True)
    return time.perf_counter() - start


def series(task, path):
    _, _, topic, field, _ = TASKS[task]
    text = subprocess.run(
        [RELEASE / "percuss-read", "trace", path, "--topic", topic, "--field", field], check=True, capture_output=True, text=True
    ).stdout
    rows = list(csv.reader(io.StringIO(text)))[1:]
    return [float(row[0]) for row in rows], [float(row[-1]) for row in rows]


def interpolated(series, t):
    times, values = series
    after = min(max(bisect.bisect_left(times, t), 1), len(times) - 1)
    share = (t - times[after - 1]) / (times[after] - times[after - 1])
    return values[after - 1] + share * (values[after] - values[after - 1])


def error(task, found, expected, n):
    """rms error over the rms of what is expected."""
    counts = TASKS[task][-1]
    pairs = [(value, interpolated(expected, t)) for t, value in zip(*found) if t > 0 and counts(t, n)]
    return (sum((a - b) ** 2 for a, b in pairs) / sum(b * b for _, b in pairs)) ** 0.5


class Scheme:
    """A scheme of percuss on a task."""

    def __init__(self, task, settings, threads, folder):
        self.task, self.settings, self.threads = task, settings, threads
        self.run = folder / "run.mcap"

    def error(self, n, reference):
        percuss("run", self.task, self.settings, n, self.threads, self.run)
        return error(self.task, series(self.task, self.run), reference, n)

    def seconds(self, n):
        return percuss("run", self.task, self.settings, n, self.threads, self.run)


class PlainC(Scheme):
    python = sys.executable

    def seconds(self, n):
        percuss("run", self.task, self.settings, n, self.threads, self.run)
        info = json.loads(
            subprocess.run([RELEASE / "percuss-read", "info", self.run, "--json"], check=True, capture_output=True, text=True).stdout
        )
        run = next(record["entries"] for record in info["metadata"] if record["name"] == "percuss.run")
        peer = [self.python, HERE / "peer.py", "plain-c", "-n", str(n), "-t", "2", "--threads", str(self.threads)]
        sweep = json.loads(subprocess.run(peer, check=True, capture_output=True, text=True).stdout.splitlines()[-1])["seconds"]
        return int(run["nz"]) * int(run["nr"]) * int(run["steps"]) / ((n + 1) * (4 * n + 1) * 2 * n) * sweep


class CalculiX:
    """Explicit bilinear elements."""

    def __init__(self, task, threads):
        self.task, self.threads = task, threads

    def computed(self, n):
        _, shared, *_ = TASKS[self.task]
        end = shared[-1].split("=")[1]
        command = [sys.executable, HERE / "calculix.py", self.task.removeprefix("elastic-"), "-n", str(n), "-t", end]
        command += ["--threads", str(self.threads)]
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    def error(self, n, reference):
        found = self.computed(n)
        return error(self.task, (found["t"], found["value"]), reference, n)

    def seconds(self, n):
        return self.computed(n)["seconds"]


def reached(scheme, reference, largest):
    """Errors by mesh, up to the second one that is right to the last tolerance."""
    errors = {}
    for n in LADDER:
        if n > largest:
            break
        errors[n] = scheme.error(n, reference)
        last = list(errors.values())[-2:]
        if len(last) == 2 and max(last) <= TOLERANCES[-1]:
            break
    return errors


def cell(scheme, errors, tolerance, rounds):
    for n in errors:
        if all(error <= tolerance for finer, error in errors.items() if finer >= n):
            seconds = statistics.median(scheme.seconds(n) for _ in range(rounds))
            return f"{seconds:.2g} s ({n})"
    return "–"


# as in graded.py cells grow without limit
BALL = """
model = "elastic"
[target]
thickness = "half-space"
material = "aluminium"
[indenter]
shape = "sphere"
nose_radius = "5 mm"
material = "steel"
[impact]
velocity = "10 m/s"
[mesh]
largest_cell = "1 m"
[run]
end_time = "30 us"
stop = "separation"
[record]
frames = 0
"""
# peak force [N] by an independent program on equal cells; contact time [s], to which both programs converge
BALL_EXPECTED = (5819.0, 25.647e-6)
BALL_LADDER = [10, 14, 20, 28, 40]
BALL_TOLERANCES = [2e-3, 1e-3, 5e-4]


def ball_by_percuss(n, folder):
    case, run = folder / "ball.toml", folder / "ball.mcap"
    case.write_text(BALL)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [RELEASE / "percuss", "run", case, "--set", f"mesh.contact_cells={n}", "--threads", "1", "-o", run, "--force", "-q"]
    subprocess.run(command, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    command = [RELEASE / "percuss-read", "summary", run, "--units", "base", "--format", "csv"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    row = next(csv.DictReader(io.StringIO(text)))
    found = [float(next(value for name, value in row.items() if name.split(" [")[0] == key)) for key in ("peak_force", "contact_duration")]
    return [seconds, seconds], found


def ball_by_elements(n, folder):
    command = [PlainC.python, HERE / "graded.py", "-n", str(n)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    text = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
    found = json.loads(text.splitlines()[-1])
    return [found["seconds"], found["seconds"] + found["assembly"]], [found["peak_force"], found["contact_time"]]


def ball(rounds, folder):
    """Both programs on all meshes, in alternation, and the seconds to a tolerance of the peak force."""
    programs = {"percuss": ball_by_percuss, "scikit-fem": ball_by_elements}
    print("\n| ball | cells | peak force [N] | contact time [µs] | CPU s | with assembly |\n|---|---|---|---|---|---|")
    found = {}
    for n in BALL_LADDER:
        runs = [{name: program(n, folder) for name, program in programs.items()} for _ in range(rounds)]
        for name in programs:
            seconds = [statistics.median(run[name][0][i] for run in runs) for i in range(2)]
            values = runs[0][name][1]
            found[name, n] = seconds, [value / expected - 1 for value, expected in zip(values, BALL_EXPECTED)]
            force, duration = (f"{value:.{digits}f} ({100 * error:+.3f} %)"
                               for value, digits, error in zip((values[0], 1e6 * values[1]), (1, 3), found[name, n][1]))
            print(f"| {name} | {n} | {force} | {duration} | {seconds[0]:.2f} | {seconds[1]:.2f} |", flush=True)
    for quantity, name in enumerate(("peak force", "contact time")):
        for tolerance in BALL_TOLERANCES:
            reached = {}
            for program in programs:
                fine = [n for n in BALL_LADDER if all(abs(found[program, m][1][quantity]) <= tolerance for m in BALL_LADDER if m >= n)]
                reached[program] = fine[0] if fine else None
            if None in reached.values():
                print(f"{name} to {tolerance:g}: cells {reached}")
                continue
            (own, _), (steps, whole) = (found[program, n][0] for program, n in reached.items())
            print(f"{name} to {tolerance:g}: cells {reached}, {steps / own:.1f} times the CPU seconds of percuss, {whole / own:.1f} with assembly")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", nargs="+", choices=[*TASKS, "ball"], default=[*TASKS, "ball"])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--largest", type=int, default=400, help="finest mesh, nodes per unit of length")
    parser.add_argument("--python", default=sys.executable, help="Python that has numpy")
    parser.add_argument("--largest-peer", type=int, default=100, help="that of CalculiX")
    options = parser.parse_args()
    PlainC.python = options.python
    with tempfile.TemporaryDirectory() as name:
        folder, threads = pathlib.Path(name), options.threads
        for task in options.task:
            if task == "ball":
                ball(options.rounds, folder)
                continue
            of = lambda settings, kind=Scheme: kind(task, settings, threads, folder)
            schemes = {
                "plain C, the paper's scheme": of(PAPER, PlainC),
                "percuss, the same": of(PAPER),
                "percuss, order 2": of(ORDER_2),
                "percuss, order 4": of([]),
            }
            if task.startswith("elastic"):
                schemes = {"CalculiX, bilinear elements, explicit": CalculiX(task, threads), "percuss": of([])}
            command, n = ("run", 2 * options.largest) if task == "axis" else ("exact", REFERENCE)
            percuss(command, task, [], n, threads, folder / "finest.mcap")
            reference = series(task, folder / "finest.mcap")
            print(f"\n| {task} | 1e-2 | 1e-3 | 1e-4 | error, nodes per length |\n|---|---|---|---|---|")
            errors = {}
            for name, scheme in schemes.items():
                largest = options.largest_peer if isinstance(scheme, CalculiX) else options.largest
                # plain C has the numbers of the paper's scheme
                same = isinstance(scheme, PlainC) or name == "percuss, the same"
                found = errors.get("paper") if same else None
                found = found or reached(scheme, reference, largest)
                if same:
                    errors["paper"] = found
                cells = " | ".join(cell(scheme, found, tolerance, options.rounds) for tolerance in TOLERANCES)
                n = list(found)[-1]
                print(f"| {name} | {cells} | {found[n]:.1e}, {n} |", flush=True)


if __name__ == "__main__":
    main()
