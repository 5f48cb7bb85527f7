#!/usr/bin/env python3
"""Two wave problems solved by CalculiX (ccx 2.20, *DYNAMIC, EXPLICIT), as a yardstick.

    calculix.py punch|paraboloid -n CELLS -t END [--beta B] [--threads K]

Prints one line of JSON: seconds of ccx, times and values.

Units: c_p = 1, density 1, c_s = beta, so mu = beta^2 and lambda = 1 - 2 beta^2. z points into the target.

punch        Plane strain, half model: the nodes 0 <= x <= 1 of the surface move with V0 = 1 from t = 0 on.
             value = drag over the punch's width. Exact until t = 2: 1 + C t.
             A mesh of bilinear elements sees the edge 0.245 of a cell past the last moved node (measured for
             beta = 0.5): x = 1 is put there, without which the error is 4 to 70 times as large.
paraboloid   Axisymmetric layer of thickness 1: the surface velocity is V0 where r^2 < k t, else 0; V0 = 0.1, k = 0.2.
             Each node gets the displacement averaged over its two cells (hat), else node crossings ring.
             value = pressure on the axis (reaction of the two innermost nodes over their area). Exact: formula (16).

Elements are C3D8, one layer thick. (CPE4 is turned into just that, at greater cost.) CAX4 becomes a wedge of
2 degrees, so thin at the axis that ccx halves its step six times; the wedge here has 60 degrees and is exact all
the same: the nodes move along radial lines, u_x = c u_r and u_y = +-s u_r with c = cos 30, s = sin 30, so that their
mass is right for u_r and u_z alike; lengths along x, y are stretched by 1/c, hence strains in the plane shrink by
c^2, which an orthotropic stiffness makes good. G_xy, which has no part in axisymmetric motion, is nearly zero.

ccx chooses the step itself: 0.78 (ALPHA=0), 0.77 (-0.05, its default) or 0.74 (-0.2) of volume / largest face / c.
DIRECT with EXPLICIT hangs at t = 0. Its RF leaves out the inertia of nodes whose motion is given: right here, where the
nodes read move at constant velocity, wrong for the whole surface under a moving edge.
"""
import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time

V0, K, LAYER = 0.1, 0.2, 1.0               # the paraboloid: velocity, r*^2 = K t, thickness
PHI = math.radians(60)                     # angle of the wedge
EDGE = 0.245                               # cells between the last moved node and the edge of the punch


def lines(numbers):
    return "".join(f"{i},\n" for i in numbers)


def block(nx, nz, dz, place, axis=False):
    """Nodes and elements of nx x nz bricks; place(i) gives (x, y) of the two sides. Returns text and numbering."""
    rows, size = nz + 1, (nx + 1) * (nz + 1)

    def node(i, j, side=0):
        return 1 + i * rows + j + (0 if axis and i == 0 else side * size)

    text = ["*NODE"]
    for i in range(nx + 1):
        for side, (x, y) in enumerate(place(i)):
            if side == 0 or not (axis and i == 0):
                text += [f"{node(i, j, side)},{x:.12g},{y:.12g},{j * dz:.12g}" for j in range(rows)]
    text.append("*ELEMENT,TYPE=C3D8,ELSET=BODY")
    for i in range(nx):
        for j in range(nz):
            corners = [node(a, b, s) for b in (j, j + 1) for a, s in ((i, 0), (i + 1, 0), (i + 1, 1), (i, 1))]
            text.append(f"{i * nz + j + 1}," + ",".join(map(str, corners)))
    return "\n".join(text) + "\n", node


def step(t_end, dz, alpha, boundary, courant):
    every = max(1, round(t_end / dz / courant / 100))       # some 100 records: a record costs about as much as a step
    return (f"*STEP,INC=10000000\n*DYNAMIC,EXPLICIT,ALPHA={alpha}\n{dz},{t_end}\n{boundary}"
            f"*NODE PRINT,NSET=OUT,TOTALS=ONLY,FREQUENCY={every}\nRF\n*END STEP\n")


def punch(n, t_end, beta):
    """Input file, and what to divide the reaction in z by; nothing that the edges of the mesh send back arrives."""
    d = 1 / (n + EDGE)
    nz = math.ceil(0.5 * (t_end + 0.2) / d)
    nx = math.ceil((1 + 0.5 * (t_end + 0.2)) / d)
    text, node = block(nx, nz, d, lambda i: ((i * d, 0), (i * d, d)))
    both = (0, 1)
    sets = {"OUT": [node(i, 0, s) for i in range(n + 1) for s in both],
            "MIDDLE": [node(0, j, s) for j in range(nz + 1) for s in both],
            "BOTTOM": [node(i, nz, s) for i in range(nx + 1) for s in both]}
    text += "".join(f"*NSET,NSET={k}\n" + lines(v) for k, v in sets.items())
    count = 2 * (nx + 1) * (nz + 1)
    mu, lam = beta**2, 1 - 2 * beta**2
    nu = lam / 2 / (lam + mu)
    text += (f"*NSET,NSET=ALL,GENERATE\n1,{count}\n*MATERIAL,NAME=M\n*ELASTIC\n{2 * mu * (1 + nu):.15g},{nu:.15g}\n"
             "*DENSITY\n1.\n*SOLID SECTION,ELSET=BODY,MATERIAL=M\n*BOUNDARY\nMIDDLE,1,1\nALL,2,2\nBOTTOM,3,3\n"
             "*AMPLITUDE,NAME=RAMP\n0.,0.,1000.,1000.\n")
    text += step(t_end, d, -0.2, "*BOUNDARY,AMPLITUDE=RAMP\nOUT,3,3,1.\n", 0.75)
    return text, d


def motion(i, d):
    """Table (t, u_z) of surface node i: V0 max(0, t - r^2/K) averaged over r with the node's hat."""
    offsets = [(2 * m + 1) / 40 - 1 for m in range(40)]
    first, last = (max(0, i - 1) * d) ** 2 / K, ((i + 1) * d) ** 2 / K
    times = [first + (last - first) * m / 12 for m in range(13)]
    table = [(t, V0 * sum((1 - abs(s)) * max(0, t - ((i + s) * d) ** 2 / K) for s in offsets) / 20) for t in times]
    return ([(0, 0)] if first > 0 else []) + table + [(last + 1000, table[-1][1] + 1000 * V0)]


def paraboloid(n, t_end, beta):
    d, nz, nx = LAYER / n, n, math.ceil(((t_end + 0.1) / 2 + 0.1) * n)
    c, slope = math.cos(PHI / 2), math.tan(PHI / 2)
    text, node = block(nx, nz, d, lambda i: ((i * d / c, -i * d / c * slope), (i * d / c, i * d / c * slope)), axis=True)
    sets = {"OUT": [node(0, 0), node(1, 0, 0), node(1, 0, 1)],
            "AXIS": [node(0, j) for j in range(nz + 1)],
            "BOTTOM": sorted({node(i, nz, s) for i in range(nx + 1) for s in (0, 1)})}
    text += "".join(f"*NSET,NSET={k}\n" + lines(v) for k, v in sets.items())
    mu, lam = beta**2, 1 - 2 * beta**2
    p, q, tiny = c**-4, c**-2, mu / 1000
    text += (f"*MATERIAL,NAME=M\n*ELASTIC,TYPE=ORTHO\n{p},{lam * p},{p},{lam * q},{lam * q},1.,{tiny},{mu * q},\n{tiny}\n"
             "*DENSITY\n1.\n*SOLID SECTION,ELSET=BODY,MATERIAL=M\n*BOUNDARY\nAXIS,1,2\nBOTTOM,3,3\n")
    for i in range(1, nx + 1):
        for j in range(nz + 1):
            for side, sign in ((0, 1), (1, -1)):
                a = node(i, j, side)
                text += f"*EQUATION\n2\n{a},2,1.,{a},1,{sign * slope:.15g}\n"
    boundary = ""
    for i in range(nx + 1):
        top = sorted({node(i, 0), node(i, 0, 1)})
        if (max(0, i - 1) * d) ** 2 / K < t_end:
            text += f"*AMPLITUDE,NAME=A{i}\n" + "".join(f"{t:.9g},{u:.9g}\n" for t, u in motion(i, d))
            boundary += "".join(f"*BOUNDARY,AMPLITUDE=A{i}\n{a},3,3,1.\n" for a in top)
        else:
            boundary += "*BOUNDARY\n" + "".join(f"{a},3,3\n" for a in top)
    text += step(t_end, d, -0.05, boundary, 0.33)
    area = 2 * slope / c**2 * d**2 * (1 / 6 + 1)     # node i > 0 has i, the one on the axis 1/6
    return text, area


def run(text, threads):
    """Runs ccx; returns seconds, times and the total reactions in z."""
    with tempfile.TemporaryDirectory(prefix="ccx-") as folder:
        with open(os.path.join(folder, "job.inp"), "w") as f:
            f.write(text)
        begin = time.perf_counter()
        out = subprocess.run(["ccx", "job"], cwd=folder, env={**os.environ, "OMP_NUM_THREADS": str(threads)},
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        seconds = time.perf_counter() - begin
        found = re.search(r"SELECTED time increment:\s*(\S+)", out.stdout)
        if out.returncode or "*ERROR" in out.stdout or not found:
            sys.exit("ccx failed:\n" + out.stdout[-2000:])
        with open(os.path.join(folder, "job.dat")) as f:
            rows = [line.split() for line in f if line.strip()]
    times = [float(r[-1]) for r in rows if r[0] == "total"]
    return seconds, times, [float(r[2]) for r in rows if r[0] != "total"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problem", choices=["punch", "paraboloid"])
    parser.add_argument("-n", type=int, required=True, help="cells per unit length")
    parser.add_argument("-t", type=float, required=True, help="end time")
    parser.add_argument("--beta", type=float, default=0.5)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    make = punch if options.problem == "punch" else paraboloid
    text, area = make(options.n, options.t, options.beta)
    seconds, times, forces = run(text, options.threads)
    print(json.dumps({"seconds": seconds, "t": times, "value": [force / area for force in forces]}))


if __name__ == "__main__":
    main()
