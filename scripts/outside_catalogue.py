#!/usr/bin/env python3
"""Diagnoses a robot that moves by what no hypothesis is of.

    BIN=build/release/bin scripts/outside_catalogue.py OUT [EFFECT ...]

A differential robot of 0.3 m between its wheels follows its commands (v, omega; steps of 5 ms) but for
one thing, in 8 runs of 40 s; poses have 2 mm and 4 mrad of noise, 20 a second.  Prints a row of a table an
effect and seed: the verdict, what was named, and what is said to be left.  A careful person names nothing
here and says that something is left, but of `none`.  Standard library only.
"""
import json
import math
import os
import random
import re
import shutil
import subprocess
import sys

STEP_S, NOISE_M, NOISE_RAD, APART_M, RADIUS_M = 0.005, 0.002, 0.004, 0.3, 0.05
AHEAD = [-0.3, -0.1, -0.03, 0.02, 0.05, 0.1, 0.2, 0.3]
TURN = [-0.8, -0.3, -0.1, 0, 0.05, 0.2, 0.5]


def threshold(least):
    return lambda v: 0 if abs(v) < least else v


class Robot:
    """What becomes of the sides' speeds, of the motion and of the poses; nothing by default."""

    def side(self, v, t):
        return v

    def motion(self, ahead, turn):
        return ahead, turn

    def pose(self, x, y, theta):
        return x, y, theta


class Eccentric(Robot):
    """The left wheel's radius is 10 % more on one side of its axle than on the other."""

    def __init__(self):
        self.angle = 0.0

    def motion(self, ahead, turn):
        left = ahead - turn * APART_M / 2
        self.angle += left / RADIUS_M * STEP_S
        more = left * 0.1 * math.cos(self.angle)
        return ahead + more / 2, turn - more / APART_M


class Caster(Robot):
    """A caster that flips pushes the robot aside in the first 0.3 s after each change of direction."""

    def __init__(self):
        self.ahead, self.since, self.side_of = 0.0, 1.0, 1

    def motion(self, ahead, turn):
        if ahead * self.ahead < 0:
            self.since, self.side_of = 0.0, 1 if ahead > 0 else -1
        self.ahead = ahead or self.ahead
        self.since += STEP_S
        return ahead, turn + (0.15 * self.side_of if self.since < 0.3 else 0)


def with_side(change):
    robot = Robot()
    robot.side = change
    return robot


def with_pose(change):
    robot = Robot()
    robot.pose = change
    return robot


def with_motion(change):
    robot = Robot()
    robot.motion = change
    return robot


EFFECTS = {
    "none": ("nothing", Robot),
    "limit": ("sides of at most 0.25 m/s", lambda: with_side(lambda v, t: max(-0.25, min(0.25, v)))),
    "threshold": ("sides that stand below 0.06 m/s", lambda: with_side(lambda v, t: threshold(0.06)(v))),
    "coarse": ("speeds in steps of 0.05 m/s", lambda: with_side(lambda v, t: 0.05 * round(v / 0.05))),
    "slip": ("slip that grows to 15 % with speed",
             lambda: with_side(lambda v, t: v * (1 - 0.15 * abs(v) / 0.3))),
    "backward": ("8 % slower backward", lambda: with_side(lambda v, t: v * (0.92 if v < 0 else 1))),
    "warming": ("10 % faster once warm (8 s)",
                lambda: with_side(lambda v, t: v * (1.1 - 0.1 * math.exp(-t / 8)))),
    "eccentric": ("a left wheel whose axle is 10 % off its middle", Eccentric),
    "caster": ("a caster that turns the robot by 0.045 rad where it flips", Caster),
    "turning": ("up to 20 % slower in turns",
                lambda: with_motion(lambda v, w: (v * (1 - 0.2 * abs(w) / 0.8), w))),
    "drift": ("turns by 0.02 rad/s of itself", lambda: with_motion(lambda v, w: (v, w + 0.02))),
    "compass": ("headings 0.05 rad off with the heading",
                lambda: with_pose(lambda x, y, a: (x, y, a + 0.05 * math.sin(a)))),
    "lens": ("places bent by 20 mm in a metre",
             lambda: with_pose(lambda x, y, a: (x + 0.02 * x * y, y - 0.01 * (x * x - y * y), a))),
}


def drive(folder, robot, seed):
    rng = random.Random(seed)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "robot.toml"), "w") as file:
        file.write('drive = "differential"\ncommands = ["v", "omega"]\n'
                   f"wheel_separation = {APART_M}\nwheel_radius = {RADIUS_M}\n")
    with open(os.path.join(folder, "commands.csv"), "w") as commands, \
            open(os.path.join(folder, "poses.csv"), "w") as poses:
        commands.write("run,t,v,omega\n")
        poses.write("run,t,x,y,theta\n")
        for run in range(1, 9):
            x, y, theta, following = 0.0, 0.0, rng.uniform(-3, 3), 0.0
            for k in range(int(40 / STEP_S)):
                t = k * STEP_S
                if t >= following - 1e-9:
                    v, w = rng.choice(AHEAD), rng.choice(TURN)
                    commands.write(f"{run},{t:.4f},{v},{w}\n")
                    following += rng.choice([1.0, 1.5, 2.0])
                left, right = (robot.side(v + s * w * APART_M / 2, t) for s in (-1, 1))
                ahead, turn = robot.motion((left + right) / 2, (right - left) / APART_M)
                if k % 10 == 0:
                    px, py, pa = robot.pose(x, y, theta)
                    poses.write(f"{run},{t:.4f},{px + rng.gauss(0, NOISE_M):.5f},"
                                f"{py + rng.gauss(0, NOISE_M):.5f},{pa + rng.gauss(0, NOISE_RAD):.5f}\n")
                x += ahead * math.cos(theta + turn * STEP_S / 2) * STEP_S
                y += ahead * math.sin(theta + turn * STEP_S / 2) * STEP_S
                theta += turn * STEP_S


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    out, names = os.path.abspath(sys.argv[1]), sys.argv[2:] or list(EFFECTS)
    program = os.path.join(os.environ.get("BIN", "build/release/bin"), "gapfarm")
    print("| truly | seed | verdict | named | left, nats a window | by |")
    print("|---|---|---|---|---|---|")
    for name in names:
        words, make = EFFECTS[name]
        for seed in (1, 2):
            folder = os.path.join(out, f"{name}_{seed}")
            shutil.rmtree(folder, ignore_errors=True)
            drive(folder, make(), seed)
            config = os.path.join(folder, "config.toml")
            with open(config, "w") as file:
                file.write('scenario = "ground"\n[robot]\nfile = "robot.toml"\n[runs]\nfolders = ["."]\n')
            subprocess.run([program, "diagnose", config, "--out", os.path.join(folder, "out")],
                           check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            with open(os.path.join(folder, "out", "diagnosis.json")) as file:
                said = json.load(file)
            named = "; ".join(f"{e['name']} " + ", ".join(f"{p['value']:+.3g}" for p in e["parameters"].values())
                              for e in said["effects"])
            finding = said["findings"][0]
            left = re.search(r"another (.*?) nats", finding)
            by = re.search(r"a correction by (.*?), closes", finding)
            print(f"| {words} | {seed} | {said['verdict']} | {named or 'nothing'} | "
                  f"{left.group(1) if left else ''} | {by.group(1) if by else '-'} |", flush=True)


if __name__ == "__main__":
    main()
