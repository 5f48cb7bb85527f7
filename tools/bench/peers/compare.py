#!/usr/bin/env python3
"""How fast percuss is beside other tools: the reference case, in alternation, as ratios.

    compare.py [--peers plain-c,numba,pystencils,devito] [-n N ...] [-t T] [--threads K] [--rounds R]
    compare.py --theory full [-n N ...] [-t T] [--threads K] [--rounds R]
    compare.py --release target/avx2/release --march x86-64-v3     as on a machine without AVX-512

Needs gcc, `cargo build --release`, and a Python with numpy, numba, pystencils and devito (see --python). The peers sweep
the whole field, record nothing, and are timed without start and compilation, on memory that has been written to. percuss
computes contact in every step, on the paper's mesh, which is that of the others, and on the matched one with as many nodes
and steps, by the schemes of order 2 and 4. It is timed twice: its steps alone, as the others are (the median of three runs in one
process: the first one is given its memory by the system), and as a whole process that records stress, drag, velocity and
probes of every step to a file. Ratios are medians over the rounds of ratios within a round.

--theory full compares model "elastic" with a plain C sweep of the same scheme, each without and with lateral damping. An update
is a step of a node, of both its displacements.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
RELEASE = HERE.parents[2] / "target" / "release"


# mesh and scheme: all have as many nodes and steps; those of order 2 and 4 are twice as long
SCHEMES = {
    "paper": (1, ["mesh.kind=paper"]),
    "order2": (2, ["mesh.order=2", "mesh.damping=0.0", "target.thickness=2.0"]),
    "order4": (2, ["mesh.order=4", "mesh.damping=1.0", "target.thickness=2.0"]),
    "elastic-undamped": (1, ["model=elastic", "mesh.damping=0.0"]),
    "elastic": (1, ["model=elastic"]),
}

# peers, the first of which is what the others are compared with, and schemes
THEORIES = {
    "simplified": (["plain-c", "numba", "pystencils", "devito"], ["paper", "order2", "order4"]),
    "full": (["elastic-c", "elastic-c-damped"], ["elastic-undamped", "elastic"]),
}


def percuss(release, scheme, n, end, threads, folder):
    factor, keys = SCHEMES[scheme]
    settings = [*keys, f"mesh.cells={n}", "mesh.outer_radius=4", "record.frames=0", f"run.end_time={factor * end}"]
    arguments = [option for setting in settings for option in ("--set", setting)]
    command = [release / "percuss", "run", "fig5", *arguments, "--threads", str(threads), "-o", folder / "run.mcap", "--force", "-q"]
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def percuss_steps(release, scheme, n, end, threads):
    command = [release / "solver-bench", "growth", "--cells", str(n), "--end", str(end), "--threads", str(threads)]
    command += ["--repeat", "3", "--scheme", scheme]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[-2])


def peer(python, name, n, end, threads, march):
    command = [python, HERE / "peer.py", name, "-n", str(n), "-t", str(end), "--threads", str(threads), "--march", march]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])["seconds"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--theory", choices=THEORIES, default="simplified")
    parser.add_argument("--peers", help="of the theory [default: all]")
    parser.add_argument("-n", type=int, nargs="+", default=[200, 500, 1000], help="nodes per unit of length")
    parser.add_argument("-t", type=float, default=6.0, help="end time")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--release", type=pathlib.Path, default=RELEASE, help="folder of the programs of percuss")
    parser.add_argument("--march", default="native", help="machine that C is compiled for")
    parser.add_argument("--python", default=sys.executable, help="Python that has the peers")
    options = parser.parse_args()
    known, schemes = THEORIES[options.theory]
    standard = known[0]
    peers = options.peers.split(",") if options.peers else known
    if standard not in peers:
        parser.error(f"{standard} is what the others are compared with")
    for name in peers:
        command = [options.python, HERE / "peer.py", name, "-n", "40", "--threads", str(options.threads), "--check"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for n in options.n:
        rounds = []
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(options.rounds):
                seconds = {name: peer(options.python, name, n, options.t, options.threads, options.march) for name in peers}
                for scheme in schemes:
                    seconds[f"{scheme}, steps"] = percuss_steps(options.release, scheme, n, options.t, options.threads)
                    seconds[f"{scheme}, whole"] = percuss(options.release, scheme, n, options.t, options.threads, pathlib.Path(folder))
                rounds.append(seconds)
        updates = (n + 1) * (4 * n + 1) * round(options.t * n)
        print(f"\nN = {n}, t = {options.t:g}, {options.threads} threads, medians of {options.rounds} rounds")
        print(f"{'':25}{'s':>9}{'1e9/s':>8}{'ratio':>8}")
        for name in rounds[0]:
            median = statistics.median(seconds[name] for seconds in rounds)
            ratio = statistics.median(seconds[standard] / seconds[name] for seconds in rounds)
            print(f"{name:25}{median:9.3f}{updates / median / 1e9:8.2f}{ratio:8.2f}", flush=True)


if __name__ == "__main__":
    main()
