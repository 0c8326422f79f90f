#!/usr/bin/env python3
"""Closes the loop of `trajc play --to stdio` on a physics engine (MuJoCo): a command file on a base with wrong wheels, latency and slip.

    closed_loop_mujoco.py COMMANDS.csv --mission M.yaml --bench FOLDER [--trajc trajc] [--only TEXT] [--json]

FOLDER holds `replay_mujoco.py`, the bench that replays command files open loop: its model of base, wheels, servos and obstacles is used as it
is; only the commands come from trajc here, one for each pose. Poses come at 20 Hz, with 5 mm and half a degree of noise (fixed seed).
The bench sets rigid castors exactly on the floor. A base with some at either end stands on them, its wheels in the air, as soon as its wheels
are smaller than the URDF's: no tyre forces at all, and the robot spins away. Real castors or wheels have springs or play, so here castors of
such a base hang 1 mm higher.
Exit: 0 every case ends within 10 mm and 1 degree without contact, 1 one does not, 2 bad input.
"""
import argparse
import json
import math
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

PLAY = 0.001  # m, between the floor and castors: wheels of 80 mm may be 1.2 % smaller
PERIOD, NOISE, TURN_NOISE, END, TURN_END = 0.05, 0.005, math.radians(0.5), 0.010, math.radians(1.0)


def build(bench_file, *arguments):
    """A bench whose castors have play where they stand on either side of the axle. They are the base's first shapes, balls without a name.
    With arms, whose centre of mass wanders: castors half a track before and behind the axle, and steps that are implicit in the servos' damping."""
    arms = len(arguments[0].moving) > 1
    castors = bench_file.castors
    if arms:
        bench_file.castors = lambda robot, *_: ([], [[robot.track / 2, 0.0], [-robot.track / 2, 0.0]])
    try:
        bench = bench_file.Bench(*arguments)
    finally:
        bench_file.castors = castors
    model = bench.model
    if arms:
        model.opt.integrator = 3  # mjINT_IMPLICITFAST
    feet = [g for g in range(model.ngeom) if model.geom_bodyid[g] == bench.base and not model.geom(g).name]
    if len(feet) and model.geom_pos[feet, 0].max() > 0 > model.geom_pos[feet, 0].min():
        model.geom_pos[feet, 2] += PLAY
    return bench


def pose_of(bench):
    turn = bench.data.xmat[bench.base].reshape(3, 3)
    return bench.data.qpos[0], bench.data.qpos[1], math.atan2(turn[1, 0], turn[0, 0])


def measured(bench, random):
    """The pose with noise, as trajc takes it."""
    x, y, yaw = pose_of(bench)
    noise = random.standard_normal(3)
    return {"x": x + NOISE * noise[0], "y": y + NOISE * noise[1], "yaw": yaw + TURN_NOISE * noise[2]}


def wheels_and_joints(bench):
    """(sides of the wheel servos, (joint that commands it, multiplier, offset) of the others)."""
    names = [bench.model.actuator(i).name for i in range(0, bench.model.nu, 2)][len(bench.wheels):]
    return ["left" if wheel[2][1] > 0 else "right" for wheel in bench.wheels], [bench.robot.source(bench.robot.joints[joint]) for joint in names]


def off_the_end(bench, columns):
    """(m, rad) between the robot and the file's last row."""
    (x, y, yaw), (to_x, to_y, to_yaw) = pose_of(bench), (columns[name][-1] for name in ("x_m", "y_m", "yaw_rad"))
    return math.hypot(x - to_x, y - to_y), abs(math.remainder(yaw - to_yaw, 2 * math.pi))


def closed(bench, mujoco, trajc, seed, seen=lambda path_time: None):
    """Drives until trajc says that it is over; (m and rad off the end, its last answer, when it came). `seen` is called a hundred times a second
    with the time of the file that trajc has reached."""
    sides, joints = wheels_and_joints(bench)
    random, run, data, step = np.random.default_rng(seed), bench.run, bench.data, bench.run.timestep
    every, late = round(PERIOD / step), run.latency
    rates, targets = np.zeros(len(bench.dofs)), bench.targets[0].copy()
    wheels = len(bench.wheels)
    waiting, answer = [], None
    for n in range(round(-0.5 / step), 10 ** 7):
        now = n * step
        if n >= 0 and n % every == 0 and (answer is None or answer["state"] not in ("done", "stopped")):
            pose = {"t": now, **measured(bench, random)}
            trajc.stdin.write(json.dumps(pose) + "\n")
            trajc.stdin.flush()
            line = trajc.stdout.readline()
            if not line:
                raise RuntimeError("trajc ended: " + trajc.stderr.read())
            answer = json.loads(line)
            waiting.append((now + late, answer))
            ended = now
        while waiting and waiting[0][0] <= now + 1e-9:
            _, command = waiting.pop(0)
            new = np.zeros(len(bench.dofs))
            for k, side in enumerate(sides):
                new[k] = bench.wheels[k][1] * command[f"wheel_{side}_rad_s"]
            for k, (source, multiplier, offset) in enumerate(joints, wheels):
                of = command["joints"].get(source)
                if of:
                    new[k], targets[k] = multiplier * of["velocity"], multiplier * of["position"] + offset
            rates = new
        data.ctrl[0::2], data.ctrl[1::2] = targets, rates
        data.qfrc_applied[bench.held] = data.qfrc_bias[bench.held]
        mujoco.mj_step(bench.model, data)
        targets = targets + rates * step
        if answer and n % 10 == 0:
            seen(answer["path_time_s"])
        if n >= 0:
            pairs, deep = data.contact.geom, data.contact.dist
            for i in np.flatnonzero(bench.is_wall[pairs].any(1) & (deep <= 0)) if len(bench.walls) else ():
                bench.contacts.setdefault(tuple(int(g) for g in pairs[i]), now)
        if answer and answer["state"] in ("done", "stopped") and now > ended + late + 1.0:
            break
        if now > 4 * bench.time[-1] + 30:
            break
    return (*off_the_end(bench, bench.columns), answer, ended)


def drive(command, bench, mujoco, seed, seen=lambda path_time: None):
    """`closed` with a trajc of its own."""
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as trajc:
        result = closed(bench, mujoco, trajc, seed, seen)
        trajc.stdin.close()
    return result


def postures(robot, columns):
    """{joint: its values}, each posture of a file once, to a hundredth."""
    find = lambda joint: next(values for name, values in columns.items() if name.startswith(f"joint.{joint}.pos_"))
    if not robot.moving:
        return {}
    rows = np.unique(np.column_stack([find(name) for name in robot.moving]).round(2), axis=0)
    return dict(zip(robot.moving, rows.T))


def prepare(bench_file, mission, commands):
    """(robot, URDF, columns, low and high corners of the boxes near the path), as a bench takes them."""
    from check_commands import read_commands, read_mission
    from oracle_maps import read_yaml

    task, columns = read_mission(mission, {}), read_commands(commands)[1]
    robot, robot_file = task.robot, Path(mission).parent / read_yaml(mission)["robot"]
    if not robot.moving_named:
        robot.hold([name for name in robot.moving if f"joint.{name}." not in " ".join(columns)])
    urdf = ElementTree.parse(robot_file.parent / read_yaml(robot_file)["urdf"]).getroot()
    lo, hi = np.zeros((0, 3)), np.zeros((0, 3))
    if task.world:
        _, high, radius = robot.extents(postures(robot, columns))
        path = np.column_stack([columns["x_m"], columns["y_m"]])
        lo, hi = bench_file.near_boxes(task.world, path, radius + bench_file.REACH, high[2] + 0.2)
    return robot, urdf, columns, lo, hi


def disturbed(change):
    """The bench's settings with some of them changed."""
    plain = dict(wheel_radius_error=0.0, radius_difference=0.0, track_error=0.0, latency=0.0, friction=0.8, bandwidth=10.0,
                 joint_bandwidth=5.0, timestep=0.001, servo="pi")
    return argparse.Namespace(**{**plain, **change})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commands")
    parser.add_argument("--mission", required=True)
    parser.add_argument("--bench", required=True)
    parser.add_argument("--trajc", default="trajc")
    parser.add_argument("--only", default="", help="cases whose name has this in it")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    sys.path.insert(0, args.bench)
    import mujoco
    import replay_mujoco as bench_file
    model = prepare(bench_file, args.mission, args.commands)
    fine, rows = True, {}
    for name, change in bench_file.CASES.items():
        if args.only not in name:
            continue
        run = disturbed(change)
        bench = build(bench_file, *model, run)
        free = bench.figures(bench.replay())
        bench = build(bench_file, *model, run)
        command = [args.trajc, "play", args.commands, "--mission", args.mission, "--to", "stdio"]
        metres, radians, answer, ended = drive(command, bench, mujoco, 1)
        good = metres <= END and radians <= TURN_END and not bench.contacts and answer["state"] == "done"
        fine &= good
        rows[name] = {"open_end_m": free["end_point_m"], "open_heading_rad": free["heading_end"], "open_contacts": len(free["contacts"]), "end_m": metres,
                      "heading_rad": radians, "contacts": len(bench.contacts), "state": answer["state"], "reason": answer.get("reason"), "time_s": ended, "good": good}
        if not args.json:
            own = rows[name]
            print(f"{name:<26} open {1e3 * own['open_end_m']:8.1f} mm {math.degrees(abs(own['open_heading_rad'])):6.2f} deg"
                  f"{' CONTACT' if own['open_contacts'] else ''} | closed {1e3 * metres:6.1f} mm {math.degrees(radians):5.2f} deg  {answer['state']}"
                  f" {answer.get('reason') or ''} {ended:.1f} s for {bench.time[-1]:.1f} s{'  CONTACT' if bench.contacts else ''}", flush=True)
    if args.json:
        print(json.dumps(rows, indent=1))
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
