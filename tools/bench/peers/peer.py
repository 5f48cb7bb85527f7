#!/usr/bin/env python3
"""The reference case of percuss in other tools: plain C, numba, pystencils, Devito; and the full theory in plain C.

    peer.py NAME [-n N] [-t T] [--threads K] [--march M] [--check]

A flat punch of radius 1 strikes a layer of thickness 1 at speed 1: nodes r = i/N out to 4, z = j/N, c_s = 0.5, time step
1/N, rest at r = 4 and z = 1. Every tool sweeps the whole field in every step, in double precision; nothing is recorded.
Prints one line of JSON: seconds of the steps alone, without start and compilation. `--check` compares the field with a
computation in NumPy first, on a small mesh.

elastic-c and elastic-c-damped are the same punch, glued, on a layer of the full theory: nodes r = (i + 1/2)/N, both displacements,
without and with lateral damping 0.5.
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


# machine that C is compiled for
MARCH = "native"


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


def compiled(name):
    """A C file beside this one as a library."""
    here = pathlib.Path(__file__).parent
    library = pathlib.Path(tempfile.mkdtemp()) / f"{name}.so"
    flags = ["-O3", f"-march={MARCH}", "-mprefer-vector-width=512", "-ffp-contract=fast", "-fno-math-errno"]
    flags += ["-fopenmp", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, here / f"{name}.c", "-o", library], check=True)
    return ctypes.CDLL(library)


def plain_c(case, threads):
    plain = compiled("plain")
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


class ElasticCase:
    """The full theory: cells between nodes, Courant number 1."""

    shear, damping = 0.25, 0.5

    def __init__(self, n, end):
        import numpy as np

        self.n, self.nz, self.nr, self.punch = n, n, 4 * n, n
        self.steps, self.push = round(end * n), 1 / n
        self.lame, self.hourglass = 1 - 2 * self.shear, min(4 * self.shear * (2 - self.shear) / 3, 0.6)
        i = np.arange(self.nr + 1, dtype=float)
        # cells by the column at their outer side; lengths in node distances
        self.cell = np.where(i > 0, 2 * i, 0.25)
        i[0] = 1
        self.outer, self.inner = (i + 0.5) / i, (i - 0.5) / i
        self.outer[0], self.inner[0] = 4, 0
        self.mass = (self.cell[:-1] + self.cell[1:]) / 2
        self.mass[0] = 1.25
        self.lateral_mass = self.mass.copy()
        self.lateral_mass[0] = 1.5

    def damping_weights(self):
        """Of the operator that damps when it is applied twice: outward and inward, of u and of v."""
        import numpy as np

        middle = np.arange(self.nr) + 0.5
        face = lambda i: np.where(i > 0, i * (i + 1) / (i + 0.5), 0)
        scale = (4 * self.damping) ** 0.5 / 16
        weights = []
        for mass in (self.mass[0], self.lateral_mass[0]):
            share = np.where(np.arange(self.nr) > 0, 1, 1 / mass)
            weights += [scale * share * face(middle + 0.5) / middle, scale * share * face(middle - 1.5) / middle]
        return weights


def elastic_in_numpy(case, is_damped):
    """Displacements at the end, shape (2, nz + 1, nr): cell by cell, from the derivative of their energy."""
    import numpy as np

    now, before = (np.zeros((2, case.nz + 1, case.nr)) for _ in range(2))
    weights = np.stack(case.damping_weights())[:, None]
    out, inw = weights[::2], weights[1::2]
    w = case.cell
    for _ in range(case.steps):
        # columns -1, the image about the axis, and nr, at rest
        u = np.pad(now[0], ((0, 0), (1, 1)))
        v = np.pad(now[1], ((0, 0), (1, 1)))
        u[:, 0], v[:, 0] = u[:, 1], -v[:, 1]
        stretch = u[1:] - u[:-1]
        flow = case.outer * v[:, 1:] - case.inner * v[:, :-1]
        sink, tilt = u[1:] + u[:-1], v[1:] - v[:-1]
        axial, lateral = (stretch[:, :-1] + stretch[:, 1:]) / 2, (flow[:-1] + flow[1:]) / 2
        shear = (sink[:, 1:] - sink[:, :-1] + tilt[:, :-1] + tilt[:, 1:]) / 2
        a, b = (stretch[:, 1:] - stretch[:, :-1]) / 2, (flow[1:] - flow[:-1]) / 2
        s, t = w * (axial + case.lame * lateral), w * case.shear * shear
        h, k = w * case.hourglass * a, case.hourglass * b
        s[:, 0] *= 2  # the half cell counts whole
        t[:, 0] = h[:, 0] = 0
        radial = case.lame * axial + lateral
        e = (s[:, :-1] + s[:, 1:]) / 2 + (h[:, :-1] - h[:, 1:]) / 2
        q = (t[:, 1:] - t[:, :-1]) / 2
        p = (t[:, :-1] + t[:, 1:]) / 2
        width = 2 * (np.arange(case.nr) + 0.5)
        upper, lower = (width / 2 * np.diff(radial + sign * k) for sign in (-1, 1))
        force = np.zeros_like(now)
        force[0, :-1] += e + q
        force[0, 1:] += q - e
        force[1, :-1] += p + upper
        force[1, 1:] += lower - p
        force[:, [0, -1]] *= 2
        new = 2 * now - before + force / np.stack([case.mass, case.lateral_mass])[:, None]
        if is_damped:
            moved = now - before
            for _ in range(2):
                # what stands inside the axis has no weight
                far = np.pad(moved, ((0, 0), (0, 0), (2, 2)))
                moved = out * (far[..., 4:] - moved) - inw * (moved - far[..., :-4])
            new -= moved
        new[0, -1] = 0
        new[0, 0, : case.punch] = now[0, 0, : case.punch] + case.push
        now, before = new, now
    return now


def elastic_c(case, threads, is_damped):
    import numpy as np

    elastic = compiled("elastic")
    # images to the left; rows that are a multiple of 4 KiB apart would share sets of the cache
    left = 8
    pitch = (left + case.nr + 2 + 7) // 8 * 8
    pitch += 8 if pitch % 512 == 0 else 0
    fields = [on_pages((case.nz + 1, pitch)) for _ in range(4)]
    mass, lateral, w = case.mass, case.lateral_mass, case.cell
    share = np.full(case.nr, 0.25)
    share[0] = 0.5
    radii = np.arange(case.nr) + 0.5
    weights = [case.inner, case.outer, share * w[:-1] / mass, 0.25 * w[1:] / mass, share * case.shear * w[:-1] / lateral,
               0.25 * case.shear * w[1:] / lateral, 0.5 * radii / lateral, *case.damping_weights()]
    weights = [np.ascontiguousarray(weight) for weight in weights]
    pointers = lambda arrays: (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
    constants = (ctypes.c_double * 3)(case.shear, case.lame, case.hourglass)

    def run():
        for field in fields:
            elastic.elastic_at_rest(ctypes.c_void_p(field.ctypes.data), case.nz + 1, ctypes.c_ssize_t(pitch), threads)
        start = time.perf_counter()
        elastic.elastic_sweeps(pointers(fields[:2]), pointers(fields[2:]), pointers(weights), constants, case.nr, case.nz,
                               ctypes.c_ssize_t(pitch), case.punch, ctypes.c_double(case.push), case.steps, threads, is_damped)
        seconds = time.perf_counter() - start
        last = case.steps % 2
        return seconds, np.stack([fields[last], fields[2 + last]])[..., left : left + case.nr]

    return run


SIMPLIFIED = {"plain-c": plain_c, "numba": in_numba, "pystencils": in_pystencils, "devito": in_devito}
# by whether it damps
ELASTIC = {"elastic-c": False, "elastic-c-damped": True}


def main():
    global MARCH
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=[*SIMPLIFIED, *ELASTIC])
    parser.add_argument("--march", default=MARCH, help="machine that C is compiled for")
    parser.add_argument("-n", type=int, default=200, help="nodes per unit of length")
    parser.add_argument("-t", type=float, default=6.0, help="end time")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--check", action="store_true", help="compare with NumPy first, N = 40")
    options = parser.parse_args()
    MARCH = options.march
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = str(options.threads)
    is_damped = ELASTIC.get(options.name)
    if is_damped is None:
        make_case, make, expected = Case, SIMPLIFIED[options.name], in_numpy
    else:
        make_case = ElasticCase
        make = lambda case, threads: elastic_c(case, threads, is_damped)
        expected = lambda case: elastic_in_numpy(case, is_damped)
    if options.check:
        import numpy as np

        case = make_case(40, 6.0)
        worst = np.abs(make(case, options.threads)()[1] - expected(case)).max()
        if worst > 1e-11:
            sys.exit(f"{options.name} differs from NumPy by {worst:.1e}")
    case = make_case(options.n, options.t)
    seconds, _ = make(case, options.threads)()
    updates = (case.nr + 1) * (case.nz + 1) * case.steps
    print(json.dumps({"peer": options.name, "seconds": seconds, "updates": updates}))


if __name__ == "__main__":
    main()
