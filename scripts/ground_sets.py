#!/usr/bin/env python3
"""Turns public logs of ground robots into robot files and folders of runs.

    scripts/ground_sets.py DATA OUT [SET ...]

DATA holds drive/, dart/, optiodom/, neato/, mrclam/, rutgers_mecanum/ and tricycle_calib/ as their
owners left them,
and the car's file in wrong_robot/case01. Makes OUT/SET/robot.toml with the maker's figures, OUT/SET/fit and OUT/SET/test
with commands.csv and poses.csv each. Measured wheel speeds are the input where a log has them.
Needs only the standard library.
"""
import csv
import glob
import math
import os
import subprocess
import sys

REST_S = 10  # between two runs on the session's clock
POSES_HZ = 25
SPEED_S = 0.2  # over which speeds are taken where polls come late or miss a cycle


def numbers(path, skip=0):
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file.read().split("\n") if line.strip()]
    return [[float(x) for x in line.split(",")] for line in lines[skip:]]


class Folder:
    """commands.csv and poses.csv, one session clock through all runs."""

    def __init__(self, channels):
        self.commands = ["run,t," + ",".join(channels)]
        self.poses = ["run,t,x,y,theta"]
        self.runs, self.clock = 0, 0.0

    def add(self, commands, poses):
        """Rows (t, values...) and (t, x, y, theta); both count from the same moment."""
        self.runs += 1
        start = min(commands[0][0], poses[0][0])
        commanded, last = None, -1e9
        for t, *values in commands:
            if values != commanded:
                row = ",".join(f"{v:.6g}" for v in values)
                self.commands.append(f"{self.runs},{self.clock + t - start:.4f},{row}")
                commanded = values
        for t, x, y, theta in poses:
            if t - last < 1 / POSES_HZ - 1e-3 and t != poses[-1][0]:
                continue
            self.poses.append(f"{self.runs},{self.clock + t - start:.4f},{x:.5f},{y:.5f},{theta:.5f}")
            last = t
        self.clock += max(commands[-1][0], poses[-1][0]) - start + REST_S

    def write(self, path):
        os.makedirs(path, exist_ok=True)
        for name, lines in (("commands.csv", self.commands), ("poses.csv", self.poses)):
            with open(os.path.join(path, name), "w", encoding="utf-8") as file:
                file.write("\n".join(lines) + "\n")


def write(out, robot, fit, test):
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(out, "robot.toml"), "w", encoding="utf-8") as file:
        file.write(robot)
    fit.write(os.path.join(out, "fit"))
    test.write(os.path.join(out, "test"))


def drive(data, out, floor):
    """A Warthog; the last third of its steps is held out."""
    parts = [Folder(["left", "right"]), Folder(["left", "right"])]
    with open(f"{data}/drive/{floor}.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    steps = sorted({int(r["step"]) for r in rows})
    for step in steps:
        mine = [r for r in rows if int(r["step"]) == step]
        number = lambda r, *keys: [float(r[k]) for k in keys]
        parts[steps.index(step) * 3 >= 2 * len(steps)].add(
            [number(r, "t", "wheel_left", "wheel_right") for r in mine],
            [number(r, "t", "x", "y", "yaw") for r in mine if r["pose_new"] == "1"])
    write(out, 'drive = "skid"\ncommands = ["left", "right"]\nmeasured = true\n'
          'wheel_separation = 1.08\nwheel_radius = 0.3\nmass = 470.0\n', *parts)


def dart(data, out, which):
    """The 1:10 car on a floor; its file is the one that its owners' figures were brought to."""
    here = os.path.dirname(os.path.abspath(__file__))
    logs = {
        "rubber": (["rubbery_floor/*12_34*", "rubbery_floor/*16_05*", "rubbery_floor/*16_47*"],
                   ["rubbery_floor/*16_09*", "rubbery_floor/*12_37*"]),
        "slippery": (["slippery_floor/*15-56*"], ["slippery_floor/*16-21*"]),
    }[which]
    os.makedirs(out, exist_ok=True)
    with open(f"{data}/wrong_robot/case01/robot.toml", encoding="utf-8") as file:
        robot = file.read()
    with open(os.path.join(out, "robot.toml"), "w", encoding="utf-8") as file:
        file.write(robot)
    for part, patterns in zip(("fit", "test"), logs):
        files = [f for p in patterns for f in sorted(glob.glob(f"{data}/dart/{p}"))]
        subprocess.run([os.path.join(here, "dart_runs.py"), os.path.join(out, part), *files],
                       check=True)


def optiodom(data, out, kind):
    """The first run of every session is fitted, the second is held out."""
    turn = 2 * math.pi
    # What a tick is in rad of the wheel; the columns of a run; what they are called.
    tick, cycle, channels, robot = {
        "diff": (turn / (64 * 43.7), 0.05, ["right", "left"],
                 'drive = "differential"\nwheel_separation = 0.2\nwheel_radius = 0.042\n'),
        "omni3": (turn / (1024 * 12), 0.04, ["w1", "w2", "w3"],
                  'drive = "omni"\nrobot_radius = 0.195\nwheel_radius = 0.051\n' + "".join(
                      f'[wheels.{name}]\nkind = "omni"\nradius = 0.051\n'
                      f"x = {0.195 * math.cos(at):.5f}\ny = {0.195 * math.sin(at):.5f}\n"
                      f"heading = {at - math.pi / 2:.5f}\n"
                      for name, at in (("w1", -math.pi / 3), ("w2", math.pi / 3), ("w3", math.pi)))),
        "omni4": (turn, 0.01, ["front_left", "front_right", "rear_left", "rear_right"],
                  'drive = "mecanum"\nwheelbase = 0.2\nwheel_separation = 0.2\nwheel_radius = 0.03\n'),
        "tricyc": (turn / 1600, 0.05, ["speed", "steering"],
                   'drive = "tricycle"\nwheelbase = 0.15\nwheel_radius = 0.0325\n'),
    }[kind]
    signs = {"omni4": [1, -1, 1, -1]}.get(kind, [1] * len(channels))
    parts = [Folder(channels), Folder(channels)]
    for path in sorted(glob.glob(f"{data}/optiodom/{kind}/*/*/*run-0[12].csv")):
        rows = numbers(path)
        commands = []
        together = round(SPEED_S / cycle) if kind == "tricyc" else 1
        for k in range(1, len(rows), together):  # ticks of the cycles that end here
            cycles = rows[k:k + together]
            means = [sum(column) / len(cycles) for column in zip(*(row[4:] for row in cycles))]
            values = [s * tick / cycle * v for s, v in zip(signs, means)]
            if kind == "tricyc":
                values[1] = means[1]
            commands.append([rows[k - 1][0], *values])
        number = int(path[-6:-4])
        parts[1 - number % 2].add(commands, [[r[0], r[1], r[2], r[3]] for r in rows])
    names = ", ".join(f'"{c}"' for c in channels)
    write(out, robot.replace("\n", f"\ncommands = [{names}]\nmeasured = true\n", 1), *parts)


def neato(data, out, _):
    """Open-loop runs with a pose at either end; every third is held out."""
    parts = [Folder(["left", "right"]), Folder(["left", "right"])]
    commands = numbers(f"{data}/neato/open_loop_commands.csv", 1)
    for i, (run, x0, y0, a0, x1, y1, a1, _) in enumerate(
            numbers(f"{data}/neato/open_loop_ends.csv", 1)):
        mine = [[t, left / 0.038, right / 0.038] for r, t, left, right in commands if r == run]
        parts[i % 3 == 2].add(mine, [[mine[0][0], x0, y0, a0], [mine[-1][0] + 1, x1, y1, a1]])
    write(out, 'drive = "differential"\ncommands = ["left", "right"]\nwheel_separation = 0.235\n'
          'wheel_radius = 0.038\n', *parts)


def mrclam(data, out, number):
    """A Create for ten minutes; the last third is held out."""
    parts = [Folder(["v", "omega"]), Folder(["v", "omega"])]
    commands = numbers(f"{data}/mrclam/dataset6_robot{number}/commands.csv", 1)
    poses = numbers(f"{data}/mrclam/dataset6_robot{number}/poses.csv", 1)
    begin, end = commands[0][0], min(commands[-1][0], poses[-1][0])
    middle = begin + 2 * (end - begin) / 3
    for part, a, b in ((0, begin, middle), (1, middle, end)):
        parts[part].add([c for c in commands if a <= c[0] < b], [p for p in poses if a <= p[0] < b])
    write(out, 'drive = "differential"\ncommands = ["v", "omega"]\nwheel_separation = 0.258\n'
          'wheel_radius = 0.033\n', *parts)


def tricycle(data, out, _):
    """A front-drive tricycle; the file is the one that its owner gives, which is wrong."""
    steer_gain, traction_gain = 0.1, 0.0106141
    rows = []
    with open(f"{data}/tricycle_calib/dataset.txt", encoding="utf-8") as file:
        for line in file:
            word = line.split()
            if not word or word[0] != "time:":
                continue
            rows.append([float(word[1]), int(word[3]), int(word[4]),
                         *(float(w) for w in word[10:13])])
    parts = [Folder(["speed", "steering"]), Folder(["speed", "steering"])]
    begin, length = rows[0][0], rows[-1][0] - rows[0][0]
    commands = [[], []]
    poses = [[], []]
    # Stamps are of receipt and jitter by half a cycle, so speeds are of a fifth of a second.
    commanded = [rows[0]]
    for row in rows:
        part = int(3 * (row[0] - begin) >= 2 * length)
        poses[part].append([row[0] - begin, *row[3:]])
        if row[0] - commanded[0][0] < SPEED_S and row is not rows[-1]:
            commanded.append(row)
            continue
        ticks = (row[2] - commanded[0][2] + 2**31) % 2**32 - 2**31
        turned = [(r[1] + 4096) % 8192 - 4096 for r in commanded]
        metres = traction_gain * ticks / 5000
        commands[part].append([commanded[0][0] - begin, metres / 0.1 / (row[0] - commanded[0][0]),
                               steer_gain * 2 * math.pi * sum(turned) / len(turned) / 8192])
        commanded = [row]
    for part in range(2):
        parts[part].add(commands[part], poses[part])
    write(out, 'drive = "tricycle"\ncommands = ["speed", "steering"]\nmeasured = true\n'
          'wheelbase = 1.4\nwheel_radius = 0.1\n[marker]\nx = 1.5\n', *parts)


def rutgers(data, out, apart):
    """A mecanum robot at constant duties; this one of its nine commands is held out, or none: then
    all are fitted and predicted.

    Wheels are where the motion says they are: [80, -80, 80, -80] drives along the camera's y, each
    wheel turns the robot to the left, and 3 and 4 push against 1 and 2 along x. Sizes are guesses.
    """
    folder = f"{data}/rutgers_mecanum"
    order = ["front_left", "front_right", "rear_left", "rear_right"]
    parts = [Folder(order), Folder(order)]
    with open(f"{folder}/takes.csv", newline="", encoding="utf-8") as file:
        takes = list(csv.DictReader(file))
    words = [tuple(take[f"w{i}"] for i in (1, 2, 3, 4)) for take in takes]
    apart = None if apart is None else list(dict.fromkeys(words))[apart]
    for take, word in zip(takes, words):
        poses = numbers(f"{folder}/take{int(take['take']):02d}_poses.csv", 1)
        # The clocks are not one: the robot starts where its way begins, back from 20 and 60 mm.
        far = [next(p[0] for p in poses if math.hypot(p[1], p[2]) > r) for r in (0.02, 0.06)]
        start = far[0] - (far[1] - far[0]) / 2
        w1, w2, w3, w4 = (int(w) / 128 for w in word)
        commands = [[start - 0.5, 0, 0, 0, 0], [start, -w4, w3, -w2, w1],
                    [start + float(take["command_seconds"]), 0, 0, 0, 0]]
        # Until then it stands, and its camera sees it now here, now 90 mrad aside: ends are counted
        # from the first frame, as its owners do.
        stood = [[start - 0.5, *poses[0][1:]]]
        for part in parts if apart is None else [parts[word == apart]]:
            part.add(commands, stood + [p for p in poses if p[0] > start - 0.5])
    names = ", ".join(f'"{name}"' for name in order)
    write(out, f'drive = "mecanum"\ncommands = [{names}]\ncommand_kind = "duties"\n'
          'full_speed = 8.0\nwheel_radius = 0.05\nwheelbase = 0.15\nwheel_separation = 0.15\n'
          f'mass = 3.0\n[marker]\nyaw = {-math.pi / 2:.6f}\n', *parts)


SETS = {
    "drive_asphalt": (drive, "asphalt_a"), "drive_gravel": (drive, "gravel"),
    "drive_sand": (drive, "sand_a"), "dart_rubber": (dart, "rubber"),
    "dart_slippery": (dart, "slippery"), "opti_diff": (optiodom, "diff"),
    "opti_omni3": (optiodom, "omni3"), "opti_omni4": (optiodom, "omni4"),
    "opti_tricycle": (optiodom, "tricyc"), "neato": (neato, None), "mrclam_1": (mrclam, 1),
    "mrclam_2": (mrclam, 2), "mrclam_3": (mrclam, 3), "tricycle_calib": (tricycle, None),
    "rutgers_all": (rutgers, None),
    **{f"rutgers_of_nine_{k + 1}": (rutgers, k) for k in range(9)},
}


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    data, out = sys.argv[1:3]
    for name in sys.argv[3:] or SETS:
        make, which = SETS[name]
        make(data, os.path.join(out, name), which)
        print(name)


if __name__ == "__main__":
    main()
