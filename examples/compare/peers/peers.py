#!/usr/bin/env python3
"""The reference jets with LAMMPS and LIGGGHTS, beside what `impinge compare` says of the same jets.

    python3 examples/compare/peers/peers.py [2000|8000] [smooth|rough] [E ...]

One core, restitution 0.8, Poisson's ratio 0.3, time step 0.1 of the Rayleigh time, until 0.06 s; the Young's moduli E (Pa) are 1e9, 1e10 and
1e11 if none are given. Prints CPU seconds, final kinetic energy over the initial one, and (LAMMPS) the energy that grains carry to the plane
at their first hits and at all hits; writes peers_N_CASE.csv into the current folder. A code that is not installed is left out
(Debian: apt-get install lammps liggghts). Only Python's standard library is needed.
"""

import csv
import math
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
RADIUS, DENSITY, SPEED, UNTIL = 0.01, 8500.0, 80.0, 0.06
POISSON, RAYLEIGH_FRACTION = 0.3, 0.1
FRICTION = {"smooth": "0", "rough": "0.4"}
# How far neighbour lists look beyond contact, and the width of bins, m: found to be the fastest.
SKIN, BIN = "0.02", "0.1"
# Steps between two looks at the grains near the plane, where a contact lasts some 16 steps: a hit is seen with the velocity of the look before.
LOOKS = 2


def grains(count):
    """Centres of the reference jet."""
    with open(os.path.join(HERE, "..", "..", "..", "tests", "data", f"jet_{count}.csv"), newline="") as file:
        return [(row["x"], row["y"], row["z"]) for row in csv.DictReader(file)]


def data(centres):
    """The jet as both codes read it."""
    lines = [f"jet of {len(centres)} grains", "", f"{len(centres)} atoms", "1 atom types", "", "-5 5 xlo xhi", "-5 5 ylo yhi",
             "-0.5 10 zlo zhi", "", "Atoms", ""]
    lines += [f"{k} 1 {2 * RADIUS} {DENSITY} {x} {y} {z}" for k, (x, y, z) in enumerate(centres, 1)]
    lines += ["", "Velocities", ""] + [f"{k} 0 0 {-SPEED} 0 0 0" for k in range(1, len(centres) + 1)]
    return "\n".join(lines) + "\n"


def steps(modulus):
    """Number of time steps and their length (s)."""
    shear = modulus / (2 * (1 + POISSON))
    rayleigh = math.pi * RADIUS * math.sqrt(DENSITY / shear) / (0.1631 * POISSON + 0.8766)
    count = math.ceil(UNTIL / (RAYLEIGH_FRACTION * rayleigh))
    return count, UNTIL / count


def run(code, modulus, case, data_file, dump):
    """CPU seconds and final over initial kinetic energy; with a dump file, hits are looked for and the time does not count."""
    count, dt = steps(modulus)
    values = dict(E=modulus, dt=dt, nsteps=count, skin=SKIN, bin=BIN, mu=FRICTION[case], data=data_file,
                  tang="off" if case == "smooth" else "history", dump=LOOKS if dump else 0, hits=dump or "none")
    script = os.path.join(HERE, "in.jet.liggghts" if "liggghts" in code else "in.jet.lammps")
    command = [code, "-in", script, "-log", "none"]
    for key, value in values.items():
        command += ["-var", key, str(value)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(command, capture_output=True, text=True, errors="replace", env=dict(os.environ, OMP_NUM_THREADS="1"))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    rows = [line.split() for line in ended.stdout.splitlines() if re.match(r"^ *\d+ +\d+ +[\d.e+]+ +[\d.e+-]+ +\d+ *$", line)]
    if ended.returncode or len(rows) < 2:
        sys.exit(f"{code} failed:\n{(ended.stdout + ended.stderr)[-1500:]}")
    first, last = rows[0], rows[-1]
    energy = (float(last[2]) + float(last[3])) / float(first[2])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, energy, int(float(last[4]))


def hits(dump, count):
    """Energy carried to the plane over the initial one, at first hits and at all: a hit is a grain whose centre comes nearer than its radius."""
    first, every, hit, before = 0.0, 0.0, set(), {}
    now, reading = {}, False

    def look():
        nonlocal first, every, before
        for grain, (height, energy) in now.items():
            if height <= RADIUS < before.get(grain, (0.0, 0.0))[0]:
                every += before[grain][1]
                first += before[grain][1] if grain not in hit else 0.0
                hit.add(grain)
        before = now

    with open(dump) as file:
        for line in file:
            if line.startswith("ITEM:"):
                reading = line.startswith("ITEM: ATOMS")
                if line.startswith("ITEM: TIMESTEP"):
                    look()
                    now = {}
            elif reading:
                grain, height, x, y, z = line.split()
                now[grain] = (float(height), 0.5 * (float(x) ** 2 + float(y) ** 2 + float(z) ** 2))
    look()
    total = 0.5 * SPEED**2 * count
    return first / total, every / total


def main():
    arguments = sys.argv[1:]
    if {"-h", "--help"} & set(arguments):
        print(__doc__)
        return
    count = int(arguments[0]) if arguments else 2000
    case = arguments[1] if len(arguments) > 1 else "smooth"
    if count not in (2000, 8000) or case not in FRICTION:
        sys.exit(__doc__)
    moduli = [float(text) for text in arguments[2:]] or [1e9, 1e10, 1e11]
    codes = [name for name in ("lmp", "liggghts") if shutil.which(name)]
    for name in {"lmp", "liggghts"} - set(codes):
        print(f"{name} is not installed: left out", file=sys.stderr)
    if not codes:
        return
    table = f"peers_{count}_{case}.csv"
    with tempfile.TemporaryDirectory() as folder, open(table, "w", newline="") as file:
        data_file, dump = os.path.join(folder, "jet.data"), os.path.join(folder, "hits.dump")
        with open(data_file, "w") as jet:
            jet.write(data(grains(count)))
        writer = csv.writer(file)
        writer.writerow(["code", "young_modulus", "steps", "cpu_seconds", "energy_final", "first_hits", "all_hits", "through_the_plane"])
        print(f"{'code':10} {'E, Pa':>8} {'steps':>8} {'CPU s':>8} {'final E':>8} {'first':>8} {'all hits':>8} {'lost':>6}")
        for code in codes:
            for modulus in moduli:
                seconds, energy, lost = run(code, modulus, case, data_file, None)
                carried = ("", "")
                if code == "lmp":
                    run(code, modulus, case, data_file, dump)
                    carried = tuple(f"{part:.4f}" for part in hits(dump, count))
                writer.writerow([code, f"{modulus:g}", steps(modulus)[0], f"{seconds:.2f}", f"{energy:.5f}", *carried, lost])
                print(f"{code:10} {modulus:8.0e} {steps(modulus)[0]:8} {seconds:8.2f} {energy:8.4f} {carried[0]:>8} {carried[1]:>8} {lost:6}",
                      flush=True)
    print(f"written to {table}")


if __name__ == "__main__":
    main()
