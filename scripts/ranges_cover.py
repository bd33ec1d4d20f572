#!/usr/bin/env python3
"""How often a MuJoCo model that is randomised by `gapfarm export ranges` covers a held-out log.

    scripts/ranges_cover.py [DRAWS]

Fits the rover's Monday (configs/rover), draws models from its ranges (default 100), lets MuJoCo drive each
through the commands of Tuesday, which was held out, and of Monday, and counts how often the measured end of a
window lies within 90 % of the draws: of each component, and of all three together (chi-squared of the draws'
covariance).  Once by the values' ranges alone, and once with what no value explains of such windows drawn beside
them ([[scatter]]).  The last line of a day is all windows and components together.
GAPFARM names the program (default: build/release/bin/gapfarm); needs libmujoco-dev.
"""
import csv
import json
import math
import os
import random
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
GAPFARM = os.environ.get("GAPFARM", ROOT + "/build/release/bin/gapfarm")
CHI_SQUARED_90 = 6.251  # of three degrees of freedom


def relative(a, b):
    """Pose b in the axes of pose a."""
    x, y = b[0] - a[0], b[1] - a[1]
    c, s = math.cos(a[2]), math.sin(a[2])
    return (c * x + s * y, c * y - s * x, math.remainder(b[2] - a[2], 2 * math.pi))


def compose(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    return (a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2])


def read(path):
    runs = {}
    for row in csv.DictReader(open(path)):
        runs.setdefault(row["run"], []).append({k: float(v) for k, v in row.items() if k != "run"})
    return runs


def solve3(m, v):
    """m^-1 v by Cramer's rule."""
    def det(a):
        return (a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
                + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]))
    whole = det(m)
    return [det([[v[i] if j == k else m[i][j] for j in range(3)] for i in range(3)]) / whole for k in range(3)]


def covered(ends, truth):
    """Of each component and of all together; all in the axes of the true end."""
    off = [relative(truth, e) for e in ends]
    n = len(off)
    hits = []
    for c in range(3):
        at = sorted(o[c] for o in off)
        hits.append(at[int(0.05 * (n - 1))] <= 0 <= at[math.ceil(0.95 * (n - 1))])
    mean = [sum(o[c] for o in off) / n for c in range(3)]
    cov = [[sum((o[a] - mean[a]) * (o[b] - mean[b]) for o in off) / (n - 1) for b in range(3)] for a in range(3)]
    hits.append(sum(m * s for m, s in zip(mean, solve3(cov, mean))) <= CHI_SQUARED_90)
    return hits


def drive(day, ranges, scene):
    """Of each run the measured poses, and those that each draw drives."""
    delay = ranges["names"].index("delay")
    half = 0.4 * 1.3 / 2  # as control.yaml has it
    commands, poses = read(f"{day}/commands.csv"), read(f"{day}/poses.csv")
    driven = {run: [] for run in poses}
    for k, values in enumerate(ranges["samples"], 1):
        open("ranges/scene.xml", "w").write(scene.replace("robot.xml", f"robot_{k:04}.xml"))
        for run in poses:
            rows = [f"{values[delay]} {half} 0.1 0.1", str(len(commands[run]))]
            rows += [f"{c['t']} {c['v']} {c['omega']}" for c in commands[run]]
            rows += [str(len(poses[run]))] + [str(p["t"]) for p in poses[run]]
            done = subprocess.run(["./follow", "ranges/scene.xml"], input="\n".join(rows), text=True, check=True,
                                  stdout=subprocess.PIPE)
            driven[run].append([tuple(map(float, line.split())) for line in done.stdout.splitlines()])
    return poses, driven


def judge(day, ranges, scene):
    poses, driven = drive(day, ranges, scene)
    noise = random.Random(1)
    every = {"ranges": [], "ranges and scatter": []}
    for s in ranges["scatter"]:
        sd = (s["along_m"], s["across_m"], s["heading_rad"])
        hits = {name: [] for name in every}
        for run, logged in poses.items():
            step = round(s["window_s"] / (logged[1]["t"] - logged[0]["t"]))
            at = [(p["x"], p["y"], p["theta"]) for p in logged]
            for a in range(step, len(at) - step, step):
                truth = relative(at[a], at[a + step])
                ends = [relative(d[a], d[a + step]) for d in driven[run]]
                hits["ranges"].append(covered(ends, truth))
                noisy = [compose(e, tuple(noise.gauss(0, x) for x in sd)) for e in ends]
                hits["ranges and scatter"].append(covered(noisy, truth))
        for name, of in hits.items():
            shares = " | ".join(f"{100 * sum(h[c] for h in of) / len(of):.0f} %" for c in range(4))
            print(f"| {day} | {len(of)} of {s['window_s']:.1f} s | {name} | {shares} |")
            every[name] += [hit for h in of for hit in h[:3]]
    for name, of in every.items():
        print(f"| {day} | all | {name} | {100 * sum(of) / len(of):.0f} % together | | | |")


def main():
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    rover = ROOT + "/configs/rover/"
    with tempfile.TemporaryDirectory() as scratch:
        os.chdir(scratch)

        def call(*words):
            return subprocess.run(words, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout

        subprocess.run(["c++", "-std=c++20", "-O2", ROOT + "/scripts/bridges/mujoco/follow.cc", "-lmujoco", "-o",
                        "follow"], check=True)
        call(GAPFARM, "robot", rover + "rover.urdf", "--controllers", rover + "control.yaml", "--out", "robot.toml",
             "--config", "rover.toml", "--runs", "monday")
        for day in ("monday", "tuesday"):
            call(GAPFARM, "import", "runs", f"{rover}{day}_cmd_vel.csv", f"{rover}{day}_tracker.csv", "--out", day)
        ranges = json.loads(call(GAPFARM, "export", "ranges", "rover.toml", "--samples", str(draws), "--seed", "1",
                                 "--out", "ranges", "--json"))
        scene = open("ranges/scene.xml").read()
        print("| log | windows | | along | across | heading | all three |\n|---|---|---|---|---|---|---|")
        for day in ("tuesday", "monday"):
            judge(day, ranges, scene)


main()
