#!/usr/bin/env python3
"""What calibration, feedback and tolerance are worth on a physics engine (MuJoCo): the tables of README.md.

    shown.py --bench FOLDER [--trajc trajc] [--missions first,site_tolerance] [--only TEXT] [--ways open,feedback] [--robots 20] [--jobs 2] [--json FILE]

FOLDER holds `replay_mujoco.py`; see closed_loop_mujoco.py. Each mission is driven by robots that are not the model's:
  open        its file, no poses
  calibrated  the robot first drives missions/calibrate.yaml (on its own floor of that size); wheel angles and poses at 20 Hz are logged, `trajc
              calibrate` writes them into a copy of robot.yaml, the mission is compiled with it, and that file driven without poses
  feedback    its first file by `trajc play --to stdio`, robot.yaml not calibrated
Poses have 5 mm and half a degree of noise (fixed seed) wherever there are any.
End: distance from the goal a second after the last command. Lateral: across the path. Tube: the most that a point of the robot may be from
where it is planned, over the clearance that is proven of the model; above 1 it is left. Being late is not leaving it.
With `--robots N` missions with a tolerance are driven, without poses, by N robots within it.
Exit: 0 feedback ends within 10 mm and 1 degree, in the tube, without contact, and no robot within a tolerance touches; 1 else; 2 bad input.
"""
import argparse
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from closed_loop_mujoco import END, PERIOD, TURN_END, build, disturbed, drive, measured, off_the_end, pose_of, postures, prepare

HOME = Path(__file__).resolve().parent.parent
MISSIONS = "first,turtlebot3_burger,arch_bridges,barn_29_tolerance,site_tolerance"
CASES = {"pose noise alone": {}, "wheels +1 %": {"wheel_radius_error": 0.01}, "wheels -1 %": {"wheel_radius_error": -0.01},
         "right wheel +0.2 %": {"radius_difference": 0.002, "wheel_radius_error": 0.001}, "track +1 %": {"track_error": 0.01},
         "track -1 %": {"track_error": -0.01}, "latency 20 ms": {"latency": 0.02}, "latency 100 ms": {"latency": 0.1}, "friction 0.3": {"friction": 0.3}}
WAYS = ("open", "calibrated", "feedback")
NO_MAP = 0.1  # m, the room that `trajc play` allows without a map
BEHIND, AHEAD = 2.0, 0.5  # s of the file around the time that it has reached, in which the robot's place on the path is sought


class Watch:
    """What a robot did: most across the path, and the share of its room that it filled."""

    def __init__(self, bench, columns, room):
        fine = np.arange(0, columns["time_s"][-1], 0.01)
        row = np.searchsorted(columns["time_s"], fine, "right") - 1
        tau = fine - columns["time_s"][row]
        bend, heading = columns["omega_rad_s"][row] * tau / 2, columns["yaw_rad"][row]
        chord = columns["v_mps"][row] * tau * np.sinc(bend / np.pi)
        self.path = np.column_stack([columns["x_m"][row] + chord * np.cos(heading + bend), columns["y_m"][row] + chord * np.sin(heading + bend), heading + 2 * bend])
        self.reach, self.room, self.bench, self.lateral, self.filled = bench.robot.extents(postures(bench.robot, columns))[2], room, bench, 0.0, 0.0

    def __call__(self, path_time):
        near = self.path[max(0, int((path_time - BEHIND) * 100)):int((path_time + AHEAD) * 100) + 1]
        near = near if len(near) else self.path[-1:]
        x, y, yaw = pose_of(self.bench)
        dx, dy = x - near[:, 0], y - near[:, 1]
        turned = np.abs((yaw - near[:, 2] + np.pi) % (2 * np.pi) - np.pi)
        off = np.hypot(dx, dy) + self.reach * turned
        at = int(off.argmin())
        self.lateral = max(self.lateral, abs(dy[at] * math.cos(near[at, 2]) - dx[at] * math.sin(near[at, 2])))
        self.filled = max(self.filled, off[at] / self.room)


def trajc(args, *words):
    done = subprocess.run([args.trajc, *map(str, words)], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"trajc {' '.join(map(str, words))}: {done.stderr}")
    return done.returncode == 0


def mission_file(path, folder, name, robot=None, without_tolerance=False):
    """A mission's file for another robot.yaml, in another folder."""
    text = (HOME / "missions" / f"{path}.yaml").read_text()
    text = re.sub(r"^robot: .*$", f"robot: {robot}", text, flags=re.M) if robot else text
    text = text.replace("../", f"{HOME}/")
    if without_tolerance:
        text = re.sub(r"^tolerance: .*$", "", text, flags=re.M)
        text += "\ntolerance: {wheel_radius: 0%, wheel_difference: 0%, track: 0%}\n"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.yaml").write_text(text)
    return folder / f"{name}.yaml"


def compiled(args, mission, folder):
    """The command file of a mission; None where there is none."""
    return folder / mission.stem / "commands.csv" if trajc(args, "compile", mission, "--out", folder, "-q") else None


def free(bench, columns, room):
    """Drives a file without poses; (m, rad) off its end, what was seen."""
    watch, step = Watch(bench, columns, room), bench.run.timestep
    end = bench.time[-1] + bench.run.latency + 1.0
    for n in range(round(-0.5 / step), round(end / step) + 1):
        if n >= 0 and n % 10 == 0:
            watch(n * step)
        bench.step(n * step)
    return (*off_the_end(bench, columns), watch)


def calibrated_robot(args, bench_file, robot_name, change, folder):
    """A robot.yaml with what the robot's own log of missions/calibrate.yaml says."""
    robot = HOME / "robots" / robot_name / "robot.yaml"
    mission = mission_file("calibrate", folder, "calibrate", robot)
    commands = compiled(args, mission, folder)
    if commands is None:
        raise RuntimeError(f"{robot_name} cannot drive missions/calibrate.yaml")
    bench = build(bench_file, *prepare(bench_file, mission, commands), disturbed(change))
    random, step, lines = np.random.default_rng(2), bench.run.timestep, ["time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad"]
    for n in range(round(-0.5 / step), round((bench.time[-1] + 1.0) / step)):
        if n >= 0 and n % round(PERIOD / step) == 0:
            angles = {"left" if wheel[2][1] > 0 else "right": wheel[1] * bench.data.qpos[bench.at[k]] for k, wheel in enumerate(bench.wheels)}
            pose = measured(bench, random)
            lines.append(f"{n * step:.3f},{angles['left']:.9f},{angles['right']:.9f},{pose['x']:.9f},{pose['y']:.9f},{pose['yaw']:.9f}")
        bench.step(n * step)
    (folder / "log.csv").write_text("\n".join(lines) + "\n")
    shutil.copytree(robot.parent, folder / "robot")
    if not trajc(args, "calibrate", folder / "log.csv", "--robot", folder / "robot" / "robot.yaml"):
        raise RuntimeError(f"calibration of {robot_name}")
    return folder / "robot" / "robot.yaml"


def case(task):
    """One mission by one robot, all three ways."""
    args, mission, name, folder = task
    bench_file, mujoco = load(args)
    change, original, commands = CASES[name], mission_file(mission, folder, mission), None
    commands = compiled(args, original, folder / "out")
    room = json.loads((commands.parent / "report.json").read_text())["certificate"].get("clearance_proven_m") or NO_MAP
    robot, urdf, columns, lo, hi = prepare(bench_file, original, commands)
    found = {}

    def note(way, metres, radians, watch, bench, state="done", remark=""):
        found[way] = {"end_m": float(metres), "end_rad": float(radians), "lateral_m": float(watch.lateral), "filled": float(watch.filled),
                      "contacts": len(bench.contacts), "state": state, "note": remark}

    if "open" in args.ways:
        bench = build(bench_file, robot, urdf, columns, lo, hi, disturbed(change))
        note("open", *free(bench, columns, room), bench)
    if "calibrated" in args.ways:
        note("calibrated", *by_calibration(args, bench_file, mission, change, folder, (robot, urdf, lo, hi)))
    if "feedback" in args.ways:
        bench = build(bench_file, robot, urdf, columns, lo, hi, disturbed(change))
        watch = Watch(bench, columns, room)
        command = [args.trajc, "play", str(commands), "--mission", str(original), "--to", "stdio"]
        metres, radians, answer, _ = drive(command, bench, mujoco, 1, watch)
        note("feedback", metres, radians, watch, bench, answer["state"], answer.get("reason") or "")
    return mission, name, found


def by_calibration(args, bench_file, mission, change, folder, truth):
    """A mission compiled with what calibration says, without poses; what `note` takes."""
    robot, urdf, lo, hi = truth
    robot_name = re.search(r"robots/(\w+)/", (HOME / "missions" / f"{mission}.yaml").read_text())[1]
    yaml, remark = calibrated_robot(args, bench_file, robot_name, change, folder / "calibration"), ""
    own = mission_file(mission, folder / "calibrated", mission, yaml)
    again = compiled(args, own, folder / "calibrated")
    if again is None:  # what calibration leaves uncertain is more than the map has room for
        remark, own = "not certified with what calibration leaves to tolerate", mission_file(mission, folder / "calibrated", mission, yaml, True)
        again = compiled(args, own, folder / "calibrated")
    new = prepare(bench_file, own, again)[2]
    bench = build(bench_file, robot, urdf, new, lo, hi, disturbed(change))
    own_room = json.loads((again.parent / "report.json").read_text())["certificate"]["clearance_proven_m"]
    return (*free(bench, new, own_room), bench, "done", remark)


def within(task):
    """A mission with a tolerance by one robot within it, without poses: (mission, contacts, least clearance, m off the end)."""
    args, mission, index, folder = task
    bench_file, _ = load(args)
    original = mission_file(mission, folder, mission)
    commands = compiled(args, original, folder / "out")
    allowed = json.loads((commands.parent / "report.json").read_text())["trust"]["tolerance"]
    random = np.random.default_rng([7, index])
    # Every second one in a corner of the tolerance, the others anywhere in it.
    share = random.choice([-1.0, 1.0], 4) if index % 2 else random.uniform(-1, 1, 4)
    change = {"wheel_radius_error": share[0] * allowed["wheel_radius"], "radius_difference": share[1] * allowed["wheel_difference"],
              "track_error": share[2] * allowed["track"], "latency": allowed["latency_s"] * random.uniform()}
    bench = build(bench_file, *prepare(bench_file, original, commands), disturbed(change))
    data, columns = bench.data, bench.columns
    far, way = allowed["start_m"] * random.uniform(), random.uniform(-math.pi, math.pi)
    yaw = columns["yaw_rad"][0] + share[3] * allowed["start_rad"]
    data.qpos[:2] += far * math.cos(way), far * math.sin(way)
    data.qpos[3:7] = math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)
    log = bench.replay()
    return mission, len(bench.contacts), float(bench.closest[0]), float(bench.figures(log)["end_point_m"])


def load(args):
    sys.dont_write_bytecode = True
    if args.bench not in sys.path:
        sys.path.insert(0, args.bench)
    import mujoco
    import replay_mujoco
    return replay_mujoco, mujoco


def cell(own):
    """End, most across the path, room filled, and what went wrong."""
    wrong = ["TUBE"] * (own["filled"] > 1) + ["CONTACT"] * (own["contacts"] > 0) + [own["state"]] * (own["state"] != "done")
    return f"{1e3 * own['end_m']:.0f} mm {math.degrees(own['end_rad']):.1f}° · {1e3 * own['lateral_m']:.0f} mm · {own['filled']:.2f}{' ' + ' '.join(wrong) if wrong else ''}"


def worst(rows):
    """Of several missions: the largest of each figure, and how many missions it went wrong on."""
    most = {key: max(row[key] for row in rows) for key in ("end_m", "end_rad", "lateral_m", "filled")}
    left, hit = sum(row["filled"] > 1 for row in rows), sum(row["contacts"] > 0 for row in rows)
    stopped = sum(row["state"] != "done" for row in rows)
    counts = [f"{count} {word}" for count, word in ((left, "left"), (hit, "contact"), (stopped, "stopped")) if count]
    return f"{1e3 * most['end_m']:.0f} mm {math.degrees(most['end_rad']):.1f}° · {1e3 * most['lateral_m']:.0f} mm · {', '.join(counts) or 'none'}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", required=True)
    parser.add_argument("--trajc", default="trajc")
    parser.add_argument("--missions", default=MISSIONS)
    parser.add_argument("--only", default="", help="cases whose name has this in it")
    parser.add_argument("--ways", default=",".join(WAYS))
    parser.add_argument("--robots", type=int, default=20, help="robots within a tolerance")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", help="all figures, to this file")
    args = parser.parse_args()
    found, fine, ways = {}, True, [way for way in WAYS if way in args.ways.split(",")]
    missions, names = args.missions.split(","), [name for name in CASES if args.only in name]
    with tempfile.TemporaryDirectory() as work, ProcessPoolExecutor(args.jobs) as pool:
        tasks = [(args, mission, name, Path(work) / mission / str(k)) for mission in missions for k, name in enumerate(names)]
        for mission, name, own in pool.map(case, tasks):
            found.setdefault(mission, {})[name] = own
            print(f"{mission:<22}{name:<20}" + " | ".join(cell(own[way]) for way in own) + "".join(f"  ({own[way]['note']})" for way in own if own[way]["note"]), flush=True)
            last = own.get("feedback")
            fine &= last is None or last["end_m"] <= END and last["end_rad"] <= TURN_END and last["filled"] <= 1 and not last["contacts"] and last["state"] == "done"
        print("\n| robot | " + " | ".join(ways) + " |\n|---|" + "---|" * len(ways))
        for name in names if found else ():
            print(f"| {name} | " + " | ".join(worst([found[mission][name][way] for mission in missions]) for way in ways) + " |")
        tolerant = [mission for mission in missions if mission.endswith("_tolerance")]
        tasks = [(args, mission, k, Path(work) / "within" / mission / str(k)) for mission in tolerant for k in range(args.robots)]
        robots = list(pool.map(within, tasks))
        for mission in tolerant if robots else ():
            own = [row for row in robots if row[0] == mission]
            touching, least, farthest = sum(row[1] > 0 for row in own), min(row[2] for row in own), max(row[3] for row in own)
            print(f"{mission}: {len(own)} robots within its tolerance: {touching} touch, least clearance {1e3 * least:.1f} mm, up to {1e3 * farthest:.0f} mm off the end")
            fine &= touching == 0
            found.setdefault(mission, {})["within"] = {"robots": len(own), "touching": touching, "clearance_min_m": least, "end_max_m": farthest}
    if args.json:
        Path(args.json).write_text(json.dumps(found, indent=1) + "\n")
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
