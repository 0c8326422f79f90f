#!/usr/bin/env python3
"""Writes calibrate.json: a log of a known robot with noise and outliers, and what scipy finds of it. Needs numpy and scipy.

    python3 calibrate.py > calibrate.json

The problem is that of src/calibrate (pairs of poses three seconds apart, each in one pair, whitened by the poses' noise, Huber's function of the
whitened length with constant 2.5), stated and solved here by other means: scipy's least_squares on residuals whose squares sum up to
Huber's function, arcs as complex numbers.
"""
import cmath
import json
import math

import numpy as np
from scipy.optimize import least_squares

TRUE, GUESS, HUBER, APART = (0.0806, 0.0802, 0.326), (0.08, 0.08, 0.32), 2.5, 3.0
NOISE, TURN = 0.005, math.radians(0.5)
MOTIONS = [(4.0, 4.0), (-2.0, 2.0), (2.0, -2.0), (3.0, 4.5), (4.5, 3.0), (4.0, 4.0), (-3.0, 3.0), (3.0, -3.0)]


def arc(z, yaw, left, right, track):
    turn, way = (right - left) / track, 0.5 * (left + right)
    chord = way * (np.sinc(turn / 2 / math.pi))
    return z + chord * cmath.exp(1j * (yaw + turn / 2)), yaw + turn


def make():
    random, rows, z, yaw, angles = np.random.default_rng(11), [], 1 + 2j, 0.3, [0.0, 0.0]
    for k in range(40 * len(MOTIONS)):
        jump = 0.3 * random.standard_normal() if random.random() < 0.03 else 0.0
        e = random.standard_normal(3)
        seen = yaw + TURN * e[2] + jump
        rows.append([0.05 * k, *angles, z.real + NOISE * e[0] + jump, z.imag + NOISE * e[1], math.atan2(math.sin(seen), math.cos(seen))])
        rates = MOTIONS[k // 40]
        z, yaw = arc(z, yaw, TRUE[0] * rates[0] * 0.05, TRUE[1] * rates[1] * 0.05, TRUE[2])
        angles = [a + 0.05 * r for a, r in zip(angles, rates)]
    return [[round(v, 9) for v in row] for row in rows]


def pairs(rows):
    used, out, second = [False] * len(rows), [], 0
    for first in range(len(rows)):
        if used[first]:
            continue
        second = max(second, first + 1)
        while second < len(rows) and (used[second] or rows[second][0] - rows[first][0] < APART):
            second += 1
        if second == len(rows):
            break
        if rows[second][0] - rows[first][0] > 2 * APART:
            continue
        used[first] = used[second] = True
        out.append((first, second))
    return out


def model(rows, first, second, parameters):
    left, right, track = parameters
    z, yaw = 0j, 0.0
    for a, b in zip(rows[first:second], rows[first + 1:second + 1]):
        z, yaw = arc(z, yaw, left * (b[1] - a[1]), right * (b[2] - a[2]), track)
    return z, yaw


def residuals(parameters, rows, chosen):
    out = []
    for first, second in chosen:
        a, b = rows[first], rows[second]
        seen = (complex(b[3], b[4]) - complex(a[3], a[4])) * cmath.exp(-1j * a[5])
        z, yaw = model(rows, first, second, parameters)
        off = np.array([seen.real - z.real, seen.imag - z.imag, math.remainder(b[5] - a[5] - yaw, 2 * math.pi)])
        lever = np.array([seen.imag, -seen.real, -1.0])
        spread = np.diag([2 * NOISE ** 2, 2 * NOISE ** 2, TURN ** 2]) + TURN ** 2 * np.outer(lever, lever)
        white = np.linalg.solve(np.linalg.cholesky(spread), off)
        size = np.linalg.norm(white)
        cost = size ** 2 if size <= HUBER else 2 * HUBER * size - HUBER ** 2
        out.extend(white * math.sqrt(cost) / max(size, 1e-300))
    return np.array(out)


rows = make()
chosen = pairs(rows)
found = least_squares(residuals, GUESS, args=(rows, chosen), x_scale=GUESS, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
print(json.dumps({"made_by": "calibrate.py, scipy.optimize.least_squares", "true": TRUE, "guess": GUESS, "pairs": len(chosen),
                  "found": found.x.tolist(), "rows": rows}))
