#!/usr/bin/env python3
"""Compiles a list of scenarios on maps of others, and counts: certified, infeasible and named as such, wrong.

    python3 examples/scenarios.py SCENARIOS.json [--trajc target/release/trajc] [--jobs 2] [--only ID]

SCENARIOS.json is a list of {id, map, robot, start: [x, y, yaw], goal: [x, y, yaw], feasible, height_m, unknown, clearance_m}; paths
are relative to it. All joints but the wheels are held at 0. A feasible scenario is right if it is certified, an infeasible one if it
fails (exit code 1) and says why.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent.parent


# m, from the makers' data sheets: where a URDF has only meshes for wheels.
WHEEL_RADII = {"stretch_se3_sg3": 0.0508}


def robot(path):
    """A robot.yaml that holds all joints still."""
    radius = WHEEL_RADII.get(path.stem)
    drive = f"drive: {{wheel_radius_m: {radius}}}\n" if radius else ""
    return f"urdf: {path}\n{drive}joints: {{moving: []}}\n"


def mission(scenario, folder, robot_yaml):
    (x, y, yaw), (goal_x, goal_y, goal_yaw) = scenario["start"], scenario["goal"]
    low, high = scenario["height_m"]
    return f"""robot: {robot_yaml}
map: {{file: {folder / scenario["map"]}, height_m: [{low}, {high}], unknown: {scenario["unknown"]}}}
start: {{x_m: {x}, y_m: {y}, yaw: {yaw}}}
goal: {{x_m: {goal_x}, y_m: {goal_y}, yaw: {goal_yaw}}}
clearance_m: {scenario["clearance_m"]}
"""


def run(scenario, folder, trajc, work, seconds_at_most):
    path, own = work / f"{scenario['id']}.yaml", work / f"{scenario['id']}_robot.yaml"
    own.write_text(robot(folder / scenario["robot"]))
    path.write_text(mission(scenario, folder, own))
    began = time.monotonic()
    command = [trajc, "compile", str(path), "--out", str(work / "out"), "--report", "none"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds_at_most)
    except subprocess.TimeoutExpired:
        return scenario, False, False, -1, float(seconds_at_most), None, "no end in time"
    seconds = time.monotonic() - began
    report = work / "out" / scenario["id"] / "report.json"
    report = json.loads(report.read_text()) if report.is_file() else {}
    certified = done.returncode == 0 and report.get("status") == "certified"
    right = certified if scenario["feasible"] else done.returncode == 1 and "failure" in report
    said = next((line for line in done.stderr.splitlines() if line.startswith("error")), "")
    proven = (report.get("certificate") or {}).get("clearance_proven_m")
    return scenario, right, certified, done.returncode, seconds, proven, said


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", type=pathlib.Path)
    parser.add_argument("--trajc", default=str(HERE / "target/release/trajc"))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seconds", type=int, default=120, help="most time for one scenario")
    parser.add_argument("--only", default="", help="only scenarios whose id holds this")
    args = parser.parse_args()
    folder = args.scenarios.resolve().parent
    scenarios = [s for s in json.loads(args.scenarios.read_text()) if args.only in s["id"]]
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        rows = list(pool.map(lambda s: run(s, folder, os.path.abspath(args.trajc), pathlib.Path(work), args.seconds), scenarios))
    for scenario, right, certified, code, seconds, proven, said in rows:
        status = "certified" if certified else "refused" if code == 1 else f"exit {code}"
        proven = "" if proven is None else f"clearance {min(proven, 99.0):.3f} of {scenario['clearance_m']}"
        print(f"{'ok   ' if right else 'WRONG'} {scenario['id']:<28} {status:<10} {seconds:6.2f} s  {proven or said}")
    feasible = [right for scenario, right, *_ in rows if scenario["feasible"]]
    other = [right for scenario, right, *_ in rows if not scenario["feasible"]]
    print(f"{sum(feasible)} of {len(feasible)} feasible ones certified, {sum(other)} of {len(other)} infeasible ones named as such")
    return 0 if all(feasible) and all(other) else 1


if __name__ == "__main__":
    sys.exit(main())
