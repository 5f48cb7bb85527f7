#!/usr/bin/env python3
"""A rigid ball strikes an elastic half-space: graded bilinear elements in explicit dynamics, with scikit-fem and SciPy, as a yardstick.

    graded.py -n CELLS [--grading Q] [--end T]

A steel ball of 10 mm (rigid, 4.110 g) strikes aluminium at 10 m/s. Prints one line of JSON: CPU seconds of the steps and of the assembly,
nodes, steps, peak force, contact time.

The mesh is that of percuss, in both directions: CELLS cells across the diameter of the largest contact by Hertz, alike to 1.5 times its
radius, then each Q times the one before as far as waves get and come back until T. Elements are axisymmetric, bilinear, with four points of integration, their masses lumped by rows; steps are central
differences, 0.98 times the largest stable one, which the largest eigenvalue says. The stiffness is a sparse matrix by rows
(in blocks of a node it takes 2 to 3 times the time). The contact has no penalty: in every step the forces on the nodes that would be inside the ball, and the
ball's velocity with them, are those that leave the nodes on its surface, by Newton's method on the set of these nodes.

Nodes that come into contact are stopped at once, which is heard: `peak_force` is that of forces averaged over 1 % of the contact, a window that
lowers the peak of a smooth pulse by 5e-5; `raw_peak_force` that of single steps.

The figures are those of accuracy.py --task ball.
"""

import argparse
import json
import math
import time

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, MeshQuad

DENSITY, C_P, C_S = 2700.0, 6420.0, 3040.0
RADIUS, VELOCITY = 5e-3, 10.0
MASS = 7850.0 * 4 / 3 * math.pi * RADIUS**3


def hertz():
    """Largest contact radius and time of contact, without waves."""
    beta2 = (C_S / C_P) ** 2
    modulus = 4 * DENSITY * C_S**2 * (1 - beta2)
    depth = (15 / 16 * MASS * VELOCITY**2 / (modulus * RADIUS**0.5)) ** 0.4
    return (RADIUS * depth) ** 0.5, 2.9433 * depth / VELOCITY


def sides(cells, grading, end):
    """Places of nodes from 0 on."""
    contact, _ = hertz()
    size, places = 2 * contact / cells, [0.0]
    while places[-1] < C_P * end / 2 + 2 * contact:
        places.append(places[-1] + size)
        if places[-1] >= 1.5 * contact:
            size *= grading
    return np.array(places)


def matrices(places):
    """Stiffness, mass and coordinates of the nodes."""
    mesh = MeshQuad.init_tensor(places, places)
    basis = Basis(mesh, ElementVector(ElementQuad1()), intorder=3)
    shear = DENSITY * C_S**2
    lame = DENSITY * C_P**2 - 2 * shear

    @BilinearForm
    def energy(u, v, w):
        r = w.x[0]
        strains = lambda u: (u.grad[0, 0], u.grad[1, 1], u[0] / r, u.grad[0, 1] + u.grad[1, 0])
        (rr, zz, tt, rz), (vrr, vzz, vtt, vrz) = strains(u), strains(v)
        stress = lambda e: lame * (rr + zz + tt) + 2 * shear * e
        return 2 * math.pi * r * (stress(rr) * vrr + stress(zz) * vzz + stress(tt) * vtt + shear * rz * vrz)

    @BilinearForm
    def inertia(u, v, w):
        return 2 * math.pi * w.x[0] * DENSITY * (u[0] * v[0] + u[1] * v[1])

    mass = np.asarray(inertia.assemble(basis).sum(axis=1)).ravel()
    return energy.assemble(basis), mass, mesh.p


def impact(cells, grading, end):
    start = time.process_time()
    stiffness, mass, points = matrices(sides(cells, grading, end))
    # nothing moves along r on the axis
    inverse = 1 / mass
    inverse[0::2][points[0] == 0] = 0
    scaled = scipy.sparse.diags(inverse**0.5)
    largest = scipy.sparse.linalg.eigsh(scaled @ stiffness @ scaled, k=1, tol=1e-3, return_eigenvectors=False)[0]
    dt = 0.98 * 2 / largest**0.5
    operator = scipy.sparse.csr_matrix(scipy.sparse.diags(dt**2 * inverse) @ stiffness)
    surface = np.flatnonzero((points[1] == 0) & (points[0] < RADIUS))
    surface = surface[np.argsort(points[0][surface])]
    r, top = points[0][surface], 2 * surface + 1
    shape = RADIUS - np.sqrt(RADIUS**2 - r**2)
    weight = mass[top] / dt**2
    assembly = time.process_time() - start

    steps = math.ceil(end / dt)
    now, moved = np.zeros(len(mass)), np.zeros(len(mass))
    ball, speed, forces = 0.0, VELOCITY * dt, np.zeros(steps)
    start = time.process_time()
    for step in range(steps):
        moved -= operator @ now
        free = now[top] + moved[top] + shape
        # the ball's place w of ball + speed − dt²/M·Σ weight·(w − free), over nodes with free < w
        w = ball + speed
        while True:
            inside = free < w
            stiff, sum_free = weight[inside].sum(), (weight[inside] * free[inside]).sum()
            share = dt**2 / MASS
            new = (ball + speed + share * sum_free) / (1 + share * stiff)
            if new >= w or not inside.any():
                break
            w = new
        push = np.where(free < w, w - free, 0.0)
        forces[step] = (weight * push).sum()
        moved[top] += push
        now += moved
        speed, ball = w - ball, w
        if step > 100 and speed < 0 and not forces[step - 50 : step + 1].any():
            steps = step + 1
            break
    seconds = time.process_time() - start
    forces = forces[:steps]
    touching = np.flatnonzero(forces)
    window = max(1, round(0.01 * hertz()[1] / dt))
    return {
        "seconds": seconds,
        "assembly": assembly,
        "nodes": len(mass) // 2,
        "steps": steps,
        "dt": dt,
        "peak_force": np.convolve(forces, np.full(window, 1 / window), "valid").max(),
        "raw_peak_force": forces.max(),
        "contact_time": (touching[-1] - touching[0]) * dt,
        "restitution": -speed / dt / VELOCITY,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=20, help="cells across the contact")
    parser.add_argument("--grading", type=float, default=1.05, help="ratio of neighbouring cells")
    parser.add_argument("--end", type=float, default=30e-6, help="time at which the run ends at the latest [s]")
    options = parser.parse_args()
    print(json.dumps(impact(options.n, options.grading, options.end)))


if __name__ == "__main__":
    main()
