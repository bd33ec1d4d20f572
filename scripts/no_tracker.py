#!/usr/bin/env python3
"""What relative poses say of a robot, beside what the same runs' world poses say.

    scripts/no_tracker.py SETS OUT [SET...]

SETS holds folders with robot.toml and fit/, such as scripts/ground_sets.py makes of public logs. The
world poses of each are thinned to 5 a second, as a laser scans, and every pose is replaced by its
increment since the one before with noise (3 mm + 1 % of the way, 2 mrad + 1 % of the turn; Censi et
al. 2013 print about these for scan matching) and what a matcher states of it, standard deviations half
as large; nothing else of the poses is kept. The kinematics are fitted to each log (`gapfarm export
ros`). The table of docs/evidence/ground_diagnosis.md is what this prints: the first of three draws of the noise, and counts over
all of them. BIN: where the programs are (build/release/bin).
"""
import json
import math
import os
import pathlib
import random
import subprocess
import sys

import ground_sets

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(os.environ.get("BIN", ROOT / "build/release/bin")) / "gapfarm"
SETS = ["opti_diff", "mrclam_1", "drive_asphalt"]
INTERVAL_S = 0.2
# Values that are no ratios, and a thousandth of their unit.
ADDED = {"marker_x": "mm", "marker_y": "mm", "marker_yaw": "mrad", "steering_offset": "mrad",
         "delay": "ms", "lag": "ms", "load_x": "mm", "load_y": "mm"}
SEED = 20261124
DRAWS = 3  # of the noise
STATED = 0.5  # of the noise's deviations
CLOSE = {"left": 0.01, "right": 0.01, "separation": 0.01, "marker_yaw": 0.003}  # shares, and rad


def run(*command):
    """Runs the program; its standard output, or the end of everything with what it said."""
    done = subprocess.run([PROGRAM, *command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"gapfarm {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def thinned(path):
    """Poses of every run, at most one an interval; (run, t, x, y, theta)."""
    kept = []
    for row in ground_sets.numbers(path, 1):
        if not kept or kept[-1][0] != row[0] or row[1] - kept[-1][1] >= INTERVAL_S - 1e-3:
            kept.append(row)
    return kept


def increments(rows, seed):
    """Each pose in the axes of the one before, with noise."""
    draw = random.Random(seed)
    out, before = [], None
    for run_name, t, x, y, theta in rows:
        d = [0.0] * 6
        if before and before[0] == run_name:
            dx, dy = x - before[2], y - before[3]
            c, s = math.cos(before[4]), math.sin(before[4])
            turn = math.remainder(theta - before[4], 2 * math.pi)
            way = math.hypot(dx, dy)
            sd = [0.003 + 0.01 * way] * 2 + [0.002 + 0.01 * abs(turn)]
            d = [v + draw.gauss(0, sigma)
                 for v, sigma in zip((c * dx + s * dy, c * dy - s * dx, turn), sd)]
            d += [STATED * sigma for sigma in sd]
        out.append((run_name, t, *d))
        before = (run_name, t, x, y, theta)
    return out


def write(folder, commands, head, rows):
    """A run folder with these poses."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "commands.csv").write_text(commands, encoding="utf-8")
    lines = [f"run,t,{head}"] + [f"{row[0]:g},{row[1]:.6f}," + ",".join(f"{v:.9f}" for v in row[2:])
                                 for row in rows]
    (folder / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def values_of(robot, runs, out):
    """What the log says of each value: key, had, says, lo, hi, known."""
    config = pathlib.Path(f"{out}.toml")
    config.write_text(f"""scenario = "ground"
[robot]
file = "{robot.resolve()}"
[runs]
folders = ["{runs.resolve()}"]
""", encoding="utf-8")
    return json.loads(run("export", "ros", config, "--json"))["kinematics"]


def main():
    """Prints the table."""
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sets, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    print("| log | value | with world poses | with increments | apart | inside |")
    print("|---|---|---|---|---|---|")
    inside, close = [], []
    for name in sys.argv[3:] or SETS:
        here, robot = out / name, sets / name / "robot.toml"
        commands = (sets / name / "fit/commands.csv").read_text(encoding="utf-8")
        rows = thinned(sets / name / "fit/poses.csv")
        write(here / "world", commands, "x,y,theta", rows)
        world = values_of(robot, here / "world", here / "run_world")
        for draw in range(DRAWS):
            write(here / f"relative{draw}", commands, "dx,dy,dtheta,sd_x,sd_y,sd_theta",
                  increments(rows, f"{SEED} {draw} {name}"))
            relative = values_of(robot, here / f"relative{draw}", here / f"run_{draw}")
            for a, b in zip(world, relative):
                added = a["name"] in ADDED
                off = b["says"] - a["says"] if added else b["says"] / a["says"] - 1
                text = f"{1000 * off:+.1f} {ADDED[a['name']]}" if added else f"{100 * off:+.2f} %"
                inside.append(b["lo"] <= a["says"] <= b["hi"])
                if a["name"] in CLOSE:
                    close.append(abs(off) <= CLOSE[a["name"]])
                if draw == 0:
                    print(f"| {name} | `{a['name']}` | {a['says']:.4g} | {b['says']:.4g} "
                          f"[{b['lo']:.4g}, {b['hi']:.4g}] | {text} | "
                          f"{'yes' if inside[-1] else 'no'} |", flush=True)
    print(f"\n{sum(inside)} of {len(inside)} values lie in the intervals of the increments; "
          f"{sum(close)} of {len(close)} radii, separations and headings are within 1 % and 3 mrad.")


if __name__ == "__main__":
    main()
