#!/usr/bin/env python3
"""The rough reference jet (friction 0.4), all pairs, nothing clever: where the reference of case B in tests/jets.rs comes from.

It shares nothing with the program: all grains stand at the same time, each keeps its first partner among all others.
usage: rough_jet.py [copies=8] [friction=0.4]     (NumPy; about half a minute a copy)
"""
import sys
from pathlib import Path

import numpy as np

R, E, UNTIL = 0.01, 0.8, 0.06
COPIES = int(sys.argv[1]) if len(sys.argv) > 1 else 8
MU = float(sys.argv[2]) if len(sys.argv) > 2 else 0.4
FLOOR, NOBODY = -1, -2


def run(x, v):
    """Masses are 1, so the moment of inertia is 2/5 R^2. Gives the five rows of tests/jets.rs."""
    n, t = len(x), 0.0
    w, hits = np.zeros_like(v), np.zeros(n, int)
    when, whom = np.full(n, np.inf), np.full(n, NOBODY)

    def energy(i=slice(None)):
        return 0.5 * np.sum(v[i] ** 2) + 0.2 * R * R * np.sum(w[i] ** 2)

    def look(i):
        """First partner of grain i, and i as the partner of whoever meets it before all others."""
        r, u = x - x[i], v - v[i]
        b, u2 = np.einsum("ij,ij->i", r, u), np.einsum("ij,ij->i", u, u)
        c = np.einsum("ij,ij->i", r, r) - 4 * R * R
        g = b * b - u2 * c
        meets = (b < 0) & (g > 0)
        meets[i] = False
        time = np.full(n, np.inf)
        time[meets] = t + np.maximum(c[meets], 0) / (-b[meets] + np.sqrt(g[meets]))
        whom[i] = np.argmin(time)
        when[i] = time[whom[i]]
        sooner = time < when
        when[sooner], whom[sooner] = time[sooner], i
        if v[i, 2] < 0:
            floor = t + max((x[i, 2] - R) / -v[i, 2], 0)
            if floor < when[i]:
                when[i], whom[i] = floor, FLOOR

    for i in range(n):
        look(i)
    start, pairs, walls, first, every = energy(), 0, 0, 0.0, 0.0
    while True:
        i = int(np.argmin(when))
        if when[i] > UNTIL:
            return energy() / start, pairs, walls, first / start, every / start
        j = int(whom[i])
        x += v * (when[i] - t)
        t = when[i]
        if j == FLOOR:
            walls, hits[i] = walls + 1, hits[i] + 1
            brought = energy(i)
            every += brought
            first += brought * (hits[i] == 1)
            normal, mass = np.array([0.0, 0.0, 1.0]), 1.0
            slip = v[i] - R * np.cross(w[i], normal)
        else:
            pairs += 1
            normal, mass = (x[i] - x[j]) / np.linalg.norm(x[i] - x[j]), 0.5
            slip = v[i] - v[j] - R * np.cross(w[i] + w[j], normal)
        approach = -slip @ normal
        slip += approach * normal
        jn, speed = (1 + E) * mass * approach, np.linalg.norm(slip)
        # Sticking takes 2/7 of the effective mass times the slip; more than mu times the normal impulse slips.
        jt = -slip / speed * min(2 / 7 * mass * speed, MU * jn) if speed > 0 else 0 * slip
        turn = np.cross(-normal, jt) / (0.4 * R)
        v[i] += jn * normal + jt
        w[i] += turn
        touched = [i]
        if j != FLOOR:
            v[j] -= jn * normal + jt
            w[j] += turn
            touched.append(j)
        lost = np.isin(whom, touched)
        lost[touched] = True
        when[lost], whom[lost] = np.inf, NOBODY
        for k in np.flatnonzero(lost):
            look(k)


start = np.loadtxt(Path(__file__).parent / "jet_2000.csv", delimiter=",", skiprows=1)
rows = []
for copy in range(COPIES):
    shift = np.random.default_rng(copy).uniform(-1e-8, 1e-8, (len(start), 3))
    rows.append(run(start[:, :3] + shift, start[:, 3:].copy()))
    print(copy, *rows[-1], flush=True)
if COPIES > 1:
    for mean, spread in zip(np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)):
        print(f"{mean:.5g} ± {spread:.2g}")
