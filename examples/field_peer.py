#!/usr/bin/env python3
"""The distance field beside the PyPI package `edt`: same distances, time per voxel as a ratio.

    cargo build --release --example field && python examples/field_peer.py [--repeats 9] [--grid X Y Z]     needs numpy, edt

The grid has boxes of 12 x 12 voxels on the ground, 20 on 10 x 10 m, 0.2 to 1 m high. Both take turns, in one thread each, and the
least times are compared: of `edt` on the grid's voxels, of ours on its (X + 1)(Y + 1)(Z + 1) nodes, each divided by its own number.
Ours is always signed; `edt` finds distances outside, then both (two runs and a difference). Then the distances themselves: `edt` is
given our lattice of nodes, with the corners of occupied voxels as sites, and must find what we find, inside too.
Processor time tells more than wall time where others use the machine.
"""
import argparse
import pathlib
import subprocess
import tempfile
import time

import edt
import numpy as np

RESOLUTION = 0.05
FIELD = pathlib.Path(__file__).parent.parent / "target/release/examples/field"


def occupancy(shape, seed=1):
    rng = np.random.default_rng(seed)
    grid = np.zeros(shape, dtype=bool)
    for _ in range(max(1, round(20 * shape[0] * shape[1] / 200**2))):
        x, y = (int(rng.integers(0, n - 12)) for n in shape[:2])
        height = 8 if shape[2] <= 8 else int(rng.integers(4, 21))
        grid[x:x + 12, y:y + 12, :height] = True
    return grid


def corners(cells):
    """Nodes that are a corner of such a cell."""
    nodes = np.zeros([n + 1 for n in cells.shape], dtype=bool)
    for a in (0, 1):
        for b in (0, 1):
            for c in (0, 1):
                nodes[a:a + cells.shape[0], b:b + cells.shape[1], c:c + cells.shape[2]] |= cells
    return nodes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--field", default=FIELD, help="our half [default: target/release/examples/field]")
    parser.add_argument("--grid", type=int, nargs=3, default=[512, 512, 64])
    args = parser.parse_args()
    occupied = occupancy(tuple(args.grid))
    voxels, nodes = occupied.size, int(np.prod([n + 1 for n in args.grid]))
    options = {"anisotropy": (RESOLUTION,) * 3, "black_border": False, "parallel": 1}
    outside, inside = (~occupied).view(np.uint8), occupied.view(np.uint8)
    peers = {
        "outside": lambda: edt.edt(outside, **options),
        "signed": lambda: edt.edt(outside, **options) - edt.edt(inside, **options),
    }
    with tempfile.TemporaryDirectory() as folder:
        grid, values = f"{folder}/grid", f"{folder}/values"
        occupied.astype(np.uint8).tofile(grid)
        command = [str(args.field), *map(str, args.grid), str(RESOLUTION), grid]
        ours = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

        def ask(line):
            ours.stdin.write(line + "\n")
            ours.stdin.flush()
            return ours.stdout.readline()

        for kind, peer in peers.items():
            least = {}
            for _ in range(args.repeats):
                started, started_cpu = time.perf_counter(), time.process_time()
                peer()
                taken = {"edt": time.perf_counter() - started, "edt cpu": time.process_time() - started_cpu}
                taken[1], taken["1 cpu"] = map(float, ask("field 1").split())
                taken[2], _ = map(float, ask("field 2").split())
                least = {name: min(t, least.get(name, t)) for name, t in taken.items()}
            per_voxel = {name: 1e9 * t / (voxels if "edt" in str(name) else nodes) for name, t in least.items()}
            for time_of, peers_time, our_time in (("wall", "edt", 1), ("processor", "edt cpu", "1 cpu")):
                theirs, own = per_voxel[peers_time], per_voxel[our_time]
                print(f"{time_of} time: edt {kind} {theirs:.2f} ns a voxel, ours {own:.2f} ns a node: {theirs / own:.2f} times")
            print(f"two threads, wall time: {least[1] / least[2]:.2f} times")
        ask(f"write {values}")
        found = np.fromfile(values, dtype=np.float32).reshape([n + 1 for n in args.grid])
        free = corners(~np.pad(occupied, 1))[1:-1, 1:-1, 1:-1]
        depth = edt.edt((~free).view(np.uint8), **options)
        expected = edt.edt((~corners(occupied)).view(np.uint8), **options) - depth
        gap = float(np.abs(found - expected).max())
        print(f"greatest difference of distances at {found.size} nodes, {np.count_nonzero(depth)} of them inside: {gap:.1e} m")
        assert gap < 1e-5
        ours.stdin.close()
        ours.wait()


if __name__ == "__main__":
    main()
