#!/usr/bin/env python3
"""The reference case of percuss in other tools: plain C, numba, pystencils, Devito.

    peer.py NAME [-n N] [-t T] [--threads K] [--check]

A flat punch of radius 1 strikes a layer of thickness 1 at speed 1: nodes r = i/N out to 4, z = j/N, c_s = 0.5, time step
1/N, rest at r = 4 and z = 1. Every tool sweeps the whole field in every step, in double precision; nothing is recorded.
Prints one line of JSON: seconds of the steps alone, without start and compilation. `--check` compares the field with a
computation in NumPy first, on a small mesh.
"""

import argparse
import ctypes
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time


class Case:
    def __init__(self, n, end):
        import numpy as np

        self.n, self.nz, self.nr, self.punch = n, n, 4 * n, n
        self.steps, self.push = round(end * n), 1 / n
        i = np.arange(self.nr, dtype=float)
        i[0] = 1
        # c_s²/4 times the radial weights; on the axis Λ_r U = 4(U_1 − U_0)
        self.out, self.inw = (1 + 0.5 / i) / 16, (1 - 0.5 / i) / 16
        self.out[0], self.inw[0] = 0.25, 0.0


def in_numpy(case):
    """The displacement at the end, shape (nr + 1, nz + 1)."""
    import numpy as np

    now, before = (np.zeros((case.nr + 1, case.nz + 1)) for _ in range(2))
    for _ in range(case.steps):
        mirrored = np.hstack([now[:, 1:2], now])
        ends = mirrored[:, :-2] + mirrored[:, 2:]
        four = ends + 2 * now[:, :-1]
        inner = np.vstack([four[:1], four[:-2]])
        new = np.zeros_like(now)
        new[:-1, :-1] = ends[:-1] - before[:-1, :-1]
        new[:-1, :-1] += case.out[:, None] * (four[1:] - four[:-1]) - case.inw[:, None] * (four[:-1] - inner)
        new[: case.punch + 1, 0] = now[: case.punch + 1, 0] + case.push
        now, before = new, now
    return now


def on_pages(shape):
    """Numbers from the beginning of a page on, which nothing has touched."""
    import numpy as np

    size, page = 8 * int(np.prod(shape)), 4096
    memory = np.empty(size + page, dtype=np.uint8)
    first = -memory.ctypes.data % page
    return memory[first : first + size].view(float).reshape(shape)


def plain_c(case, threads):
    import numpy as np

    here = pathlib.Path(__file__).parent
    library = pathlib.Path(tempfile.mkdtemp()) / "plain.so"
    flags = ["-O3", "-march=native", "-mprefer-vector-width=512", "-ffp-contract=fast", "-fno-math-errno"]
    flags += ["-fopenmp", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, here / "plain.c", "-o", library], check=True)
    plain = ctypes.CDLL(library)
    # columns that are a multiple of 4 KiB apart would share sets of the cache
    pitch = (case.nz + 1 + 15) // 16 * 16 + 16
    fields = [on_pages((case.nr + 1, pitch)) for _ in range(2)]
    pointer = lambda array: ctypes.c_void_p(array.ctypes.data)

    def run():
        for field in fields:
            plain.at_rest(pointer(field), ctypes.c_long(field.size), threads)
        start = time.perf_counter()
        plain.sweeps(pointer(fields[0]), pointer(fields[1]), pointer(case.out), pointer(case.inw), case.nr, case.nz,
                     ctypes.c_ssize_t(pitch), case.punch, ctypes.c_double(case.push), case.steps, threads)
        seconds = time.perf_counter() - start
        return seconds, fields[case.steps % 2][:, : case.nz + 1]

    return run


def in_numba(case, threads):
    import numba
    import numpy as np

    numba.set_num_threads(threads)

    @numba.njit(parallel=True, fastmath=True)
    def sweep(now, next, out, inw, nr, nz, punch, push):
        for i in numba.prange(nr):
            here, outer, inner, column = now[i], now[i + 1], now[max(i - 1, 0)], next[i]
            a, b = out[i], inw[i]
            c = -(a + b)
            if i <= punch:
                column[0] = here[0] + push
            else:
                column[0] = 2 * here[1] - column[0] + 2 * (
                    a * (outer[0] + outer[1]) + c * (here[0] + here[1]) + b * (inner[0] + inner[1]))
            for j in range(1, nz):
                column[j] = here[j - 1] + here[j + 1] - column[j] + (
                    a * (outer[j - 1] + 2 * outer[j] + outer[j + 1])
                    + c * (here[j - 1] + 2 * here[j] + here[j + 1])
                    + b * (inner[j - 1] + 2 * inner[j] + inner[j + 1]))

    pitch = (case.nz + 1 + 7) // 8 * 8 + 8
    fields = [np.zeros((case.nr + 1, pitch)) for _ in range(2)]
    arguments = case.out, case.inw, case.nr, case.nz, case.punch, case.push
    sweep(*fields, *arguments)

    def run():
        for field in fields:
            field[:] = 0
        start = time.perf_counter()
        for k in range(case.steps):
            sweep(fields[k % 2], fields[(k + 1) % 2], *arguments)
        return time.perf_counter() - start, fields[case.steps % 2][:, : case.nz + 1]

    return run


def in_pystencils(case, threads):
    import numpy as np
    import pystencils as ps

    u, new = ps.fields("u, new: double[2D]", layout="c")
    weights = ps.fields("out, inw: double[1D]", layout="c", field_type=ps.FieldType.CUSTOM)
    a, b = (weight.absolute_access((ps.x_,), (0,)) for weight in weights)
    four = lambda i: u[i, -1] + 2 * u[i, 0] + u[i, 1]
    scheme = ps.Assignment(
        new.center, u[0, -1] + u[0, 1] - new.center + (a * four(1) - (a + b) * four(0) + b * four(-1)))
    config = ps.CreateKernelConfig(target=ps.Target.GenericCPU, default_dtype="double")
    config.cpu.openmp.enable = True
    config.cpu.openmp.num_threads = threads
    kernel = ps.create_kernel(scheme, config).compile()
    # a column before the axis and the image of row 1 before row 0
    pitch = (case.nz + 2 + 7) // 8 * 8 + 8
    fields = [np.zeros((case.nr + 2, pitch))[:, : case.nz + 2] for _ in range(2)]
    out, inw = (np.concatenate([[0.0], weight]) for weight in (case.out, case.inw))

    def run():
        for field in fields:
            field[:] = 0
        now, next = fields
        start = time.perf_counter()
        for _ in range(case.steps):
            kernel(u=now, new=next, out=out, inw=inw)
            next[1 : case.punch + 2, 1] = now[1 : case.punch + 2, 1] + case.push
            next[:, 0] = next[:, 2]
            now, next = next, now
        return time.perf_counter() - start, now[1:, 1:]

    return run


def in_devito(case, threads):
    os.environ.update(DEVITO_LOGGING="ERROR", DEVITO_LANGUAGE="openmp", DEVITO_ARCH="gcc")
    import numpy as np
    from devito import Constant, Eq, Function, Grid, Operator, SpaceDimension, TimeFunction

    z, r = (SpaceDimension(name=name, spacing=Constant(name="h_" + name, value=1.0)) for name in "zr")
    grid = Grid(shape=(case.nz, case.nr), dimensions=(z, r), dtype=np.float64)
    u = TimeFunction(name="u", grid=grid, space_order=2, time_order=2)
    line = lambda name: Function(name=name, grid=grid, dimensions=(r,), shape=(case.nr,), space_order=0)
    out, inw, pressed = line("a"), line("b"), line("pressed")
    out.data[:], inw.data[:] = case.out, case.inw
    pressed.data[:] = np.arange(case.nr) <= case.punch
    t = grid.stepping_dim
    four = lambda i: u[t, z - 1, i] + 2 * u[t, z, i] + u[t, z + 1, i]
    new = u[t, z - 1, r] + u[t, z + 1, r] - u[t - 1, z, r]
    new += out[r] * four(r + 1) - (out[r] + inw[r]) * four(r) + inw[r] * four(r - 1)
    operator = Operator([
        Eq(u[t + 1, z, r], new),
        Eq(u[t + 1, 0, r], pressed[r] * (u[t, 0, r] + case.push) + (1 - pressed[r]) * u[t + 1, 0, r]),
        Eq(u[t + 1, -1, r], u[t + 1, 1, r]),
    ], opt=("advanced", {"openmp": True}))
    operator.apply(time_m=1, time_M=2, nthreads=threads)

    def run():
        u.data_with_halo[:] = 0
        start = time.perf_counter()
        operator.apply(time_m=1, time_M=case.steps, nthreads=threads)
        seconds = time.perf_counter() - start
        whole = np.asarray(u.data_with_halo[(case.steps + 1) % 3])
        halo = (whole.shape[0] - case.nz) // 2
        return seconds, whole[halo:, halo:].T[: case.nr + 1, : case.nz + 1]

    return run


PEERS = {"plain-c": plain_c, "numba": in_numba, "pystencils": in_pystencils, "devito": in_devito}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=PEERS)
    parser.add_argument("-n", type=int, default=200, help="nodes per unit of length")
    parser.add_argument("-t", type=float, default=6.0, help="end time")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--check", action="store_true", help="compare with NumPy first, N = 40")
    options = parser.parse_args()
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = str(options.threads)
    make = PEERS[options.name]
    if options.check:
        import numpy as np

        case = Case(40, 6.0)
        worst = np.abs(make(case, options.threads)()[1] - in_numpy(case)).max()
        if worst > 1e-11:
            sys.exit(f"{options.name} differs from NumPy by {worst:.1e}")
    case = Case(options.n, options.t)
    seconds, _ = make(case, options.threads)()
    updates = (case.nr + 1) * (case.nz + 1) * case.steps
    print(json.dumps({"peer": options.name, "seconds": seconds, "updates": updates}))


if __name__ == "__main__":
    main()
