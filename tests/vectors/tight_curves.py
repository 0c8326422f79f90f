#!/usr/bin/env python3
"""Least times on curves tighter than half the track, where [CONV] Eq. 5 has no answer; makes tight_curves.json.

    python tight_curves.py FOLDER/OF/time_laws.py -o tight_curves.json        needs numpy, scipy, casadi, toppra

Hairpins (0, 0), (2, 0), (2, w), (0, w) whose least radius, in the middle, is R: there |p'| = 1.5 w and the curvature is 12 / (1.5 w)^2,
so w = sqrt(12 R) / 1.5. Solvers, robot and limits are those of time_laws.py; only the table of the curvature that its optimum reads is
finer, since a hairpin's curvature is a narrow peak.
"""
import argparse
import json
import sys
from importlib.metadata import version

import casadi as ca
import numpy as np

RADII = (0.1, 0.02)
KNOTS = 3001


def limit_function(path, piece):
    """As in time_laws.py, with more knots."""
    knots = np.linspace(path.breaks[piece], path.breaks[piece + 1], KNOTS)
    inside = knots.clip(knots[0] + 1e-9, knots[-1] - 1e-9)
    bend = ca.interpolant("k", "bspline", [knots], path.curvature(inside)[0], {"degree": [5]})
    x, w = ca.MX.sym("x", 3), ca.MX.sym("w")
    k = bend(x[0])
    k1 = ca.jacobian(k, x)[0]
    k2 = ca.jacobian(k1, x)[0]
    rows = []
    for sign in (1, -1):
        f, f1, f2 = 1 + sign * laws.HALF * k, sign * laws.HALF * k1, sign * laws.HALF * k2
        rows += [f * x[1] / laws.V, (f * x[2] + f1 * x[1] ** 2) / laws.A,
                 (f * w + 3 * f1 * x[1] * x[2] + f2 * x[1] ** 3) / laws.J]
    return ca.Function("limits", [x, w], [ca.vertcat(*rows)])


def measure(path, points, intervals):
    row = {"control_points": [points], "length": round(path.length, 6), "max_curvature": round(path.max_curvature, 6)}
    row["toppra"] = {"time": round(laws.toppra_time(path)[0], 4)}
    # The guess is a crawl: the profile in the faster wheel's travel, read off at equal times.
    grid = np.linspace(0, path.length, 200001)
    h = 1 + laws.HALF * np.abs(path.curvature(grid)[0])
    travel = np.concatenate([[0], np.cumsum((h[1:] + h[:-1]) / 2 * np.diff(grid))])
    boxes = laws.box_lengths(travel[-1])
    runs = []
    for stretch in (1.3, 2.0):
        t = np.linspace(0, sum(boxes), intervals + 1)
        l, ld, ldd, _ = laws.convolution(travel[-1], boxes, t)
        s = np.interp(l, travel, grid)
        k, k1, _ = path.curvature(s)
        f, f1 = 1 + laws.HALF * np.abs(k), laws.HALF * np.sign(k) * k1
        sd = ld / f
        guess = (sum(boxes) * stretch, s, sd / stretch, (ldd - f1 * sd**2) / f / stretch**2)
        T, motion, seconds, status = laws.optimum(path, guess)
        runs.append({"N": intervals, "status": status, **laws.report(path, T, motion)})
        print(path.name, round(seconds, 1), "s", runs[-1], flush=True)
    runs.sort(key=lambda r: r["time"])
    row["optimum"] = {**runs[0], "other_guess_time": runs[1]["time"]}
    return row


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("folder", help="folder of time_laws.py")
parser.add_argument("-o", "--output", required=True)
parser.add_argument("-N", type=int, default=400, help="intervals of the optimum")
args = parser.parse_args()
sys.path.insert(0, args.folder)
import time_laws as laws  # noqa: E402

laws.limit_function = limit_function
packages = {p: version(p) for p in ("toppra", "casadi", "numpy", "scipy")}
document = {"source": "tight_curves.py, with the solvers of time_laws.py; " + ", ".join(f"{p} {v}" for p, v in packages.items()),
            "limits": {"track": laws.TRACK, "wheel_radius": laws.WHEEL_RADIUS, "v": laws.V, "a": laws.A, "j": laws.J}, "paths": {}}
for radius in RADII:
    width = round((12 * radius) ** 0.5 / 1.5, 12)
    points = [[0.0, 0.0], [2.0, 0.0], [2.0, width], [0.0, width]]
    name = f"hairpin_{round(1e3 * radius)}mm"
    document["paths"][name] = measure(laws.Path(name, [points]), points, args.N)
with open(args.output, "w") as out:
    out.write(json.dumps(document, indent=1) + "\n")
