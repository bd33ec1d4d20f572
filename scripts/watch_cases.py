#!/usr/bin/env python3
"""Sealed changes in the logs of robots of one kind, and what `gapfarm watch` makes of them.

    scripts/watch_cases.py DATA OUT [--cases N] [--nulls N] [--seed S] [--radius R] [--length S]

DATA holds mrclam/ (Creates that drove at once for ten minutes, UTIAS MRCLAM). Each robot's log is cut
into runs of S seconds (40). In a case one wheel of one robot is R smaller (0.02) from run k on: what
it travelled between two poses is made so much less. Commands stay: a Create makes 7 % more of those
that turn a little, so changed commands would change more than a wheel. Robot, wheel
and k are drawn from the seed; three runs at least lie before k and behind. Where the cuts begin is
drawn too. In a null case nothing is changed, and the runs of each robot come in another order (of the
first null in their own). truth.json of a case is never read by the program. Prints a table, and what
was missed. BIN: where the programs are (build/release/bin).
"""
import argparse
import json
import math
import os
import pathlib
import random
import shutil
import subprocess

import ground_sets

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(os.environ.get("BIN", ROOT / "build/release/bin")) / "gapfarm"
SEPARATION_M = 0.258
LEAST_RUNS = 3  # on either side of a change
ROBOT = f"""drive = "differential"
commands = ["v", "omega"]
wheel_separation = {SEPARATION_M}
wheel_radius = 0.033
"""


def runs_of(data, robot, begin, length):
    """Rows of commands and poses of each stretch of `length` seconds from `begin` on."""
    commands = ground_sets.numbers(f"{data}/mrclam/{robot}/commands.csv", 1)
    poses = ground_sets.numbers(f"{data}/mrclam/{robot}/poses.csv", 1)
    start, end = commands[0][0] + begin, min(commands[-1][0], poses[-1][0])
    runs = []
    for k in range(int((end - start) / length)):
        a, b = start + k * length, start + (k + 1) * length
        runs.append(([c for c in commands if a <= c[0] < b], [p for p in poses if a <= p[0] < b]))
    return runs


def with_smaller_wheel(poses, wheel, radius):
    """The poses of a robot with this wheel smaller, given the same commands."""
    changed = [list(poses[0])]
    for before, after in zip(poses, poses[1:]):
        dx, dy = after[1] - before[1], after[2] - before[2]
        turn = math.remainder(after[3] - before[3], 2 * math.pi)
        middle = before[3] + turn / 2
        ahead = dx * math.cos(middle) + dy * math.sin(middle)
        aside = dy * math.cos(middle) - dx * math.sin(middle)
        left, right = ahead - turn * SEPARATION_M / 2, ahead + turn * SEPARATION_M / 2
        if wheel == "left":
            left *= 1 - radius
        else:
            right *= 1 - radius
        ahead, turn = (left + right) / 2, (right - left) / SEPARATION_M
        _, x, y, theta = changed[-1]
        c, s = math.cos(theta + turn / 2), math.sin(theta + turn / 2)
        changed.append([after[0], x + c * ahead - s * aside, y + s * ahead + c * aside, theta + turn])
    return changed


def write_case(folder, robots, truth):
    """DIR/ROBOT/RUN, and what is sealed beside it."""
    shutil.rmtree(folder, ignore_errors=True)
    for robot, runs in robots.items():
        for number, (commands, poses) in enumerate(runs):
            rows = ground_sets.Folder(["v", "omega"])
            rows.add(commands, poses)
            rows.write(folder / "fleet" / robot / f"run{number + 1}")
    (folder / "fleet/robot.toml").write_text(ROBOT, encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(truth), encoding="utf-8")


def make_case(data, folder, seed, options, null):
    """Null: 0 for a change, else the number of the null case."""
    draw = random.Random(seed)
    begin = draw.uniform(0, options.length)
    names = sorted(path.name for path in pathlib.Path(f"{data}/mrclam").iterdir() if path.is_dir())
    robots = {name: runs_of(data, name, begin, options.length) for name in names}
    if null:
        for runs in robots.values():
            if null > 1:
                draw.shuffle(runs)
        write_case(folder, robots, {})
        return
    robot, wheel = draw.choice(names), draw.choice(["left", "right"])
    runs = robots[robot]
    onset = draw.randint(LEAST_RUNS, len(runs) - LEAST_RUNS)
    for k in range(onset, len(runs)):
        runs[k] = (runs[k][0], with_smaller_wheel(runs[k][1], wheel, options.radius))
    write_case(folder, robots, {"robot": robot, "value": wheel, "onset": onset + 1})


def watch(folder):
    """What the program says."""
    done = subprocess.run([PROGRAM, "watch", folder / "fleet", "--out", folder / "watched", "--json"],
                          capture_output=True, text=True, check=False)
    if done.returncode not in (0, 4):
        raise SystemExit(done.stdout + done.stderr)
    return json.loads(done.stdout)


def in_sight(said, truth, radius):
    """Whether a change of this size from that run on is named with 95 %, as the program says."""
    robot = next(r for r in said["robots"] if r["robot"] == truth["robot"])
    return robot["detectable"][truth["value"]][truth["onset"] - 1] <= radius


def judge(said, truth, radius):
    """Unit, effect and onset right, the interval holds the change; further names."""
    mine = [s for s in said["steps"] if s["robot"] == truth["robot"]]
    best = max(mine, key=lambda s: s["statistic"], default=None)
    others = len(said["steps"]) + len(said["odd_robots"]) - (best is not None)
    if best is None:
        return False, False, False, False, others
    effect = best["value"] == truth["value"]
    return (True, effect, abs(best["onset_number"] - truth["onset"]) <= 2,
            effect and best["lo"] <= -radius <= best["hi"], others)


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--nulls", type=int, default=40)
    parser.add_argument("--seed", type=int, default=20261125)
    parser.add_argument("--radius", type=float, default=0.02)
    parser.add_argument("--length", type=float, default=40)
    options = parser.parse_args()
    sums, runs, alarms, seen, seen_right = [0] * 5, 0, 0, 0, 0
    for k in range(options.cases):
        folder = options.out / f"case{k + 1}"
        make_case(options.data, folder, f"{options.seed} case {k}", options, 0)
        said = watch(folder)
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        verdicts = judge(said, truth, options.radius)
        sums = [a + b for a, b in zip(sums, verdicts)]
        seen += in_sight(said, truth, options.radius)
        seen_right += in_sight(said, truth, options.radius) and verdicts[0]
        if not all(verdicts[:4]) or verdicts[4]:
            print(f"case {k + 1}: {truth}: unit, effect, onset, interval, others {verdicts}: ",
                  [(s["robot"], s["value"], s["onset_number"], round(s["change"], 4),
                    round(s["statistic"], 1)) for s in said["steps"]],
                  [(s["robot"], s["value"], round(s["change"], 4)) for s in said["odd_robots"]],
                  said["odd_runs"], flush=True)
    for k in range(options.nulls):
        folder = options.out / f"null{k + 1}"
        make_case(options.data, folder, f"{options.seed} null {k}", options, k + 1)
        said = watch(folder)
        runs += sum(len(robot["runs"]) for robot in said["robots"])
        names = said["steps"] + said["odd_robots"]
        alarms += len(names)
        if names or said["odd_runs"]:
            print(f"null {k + 1}:", names, said["odd_runs"], flush=True)
    print("\n| cases | unit | effect | onset within 2 runs | 90 % interval holds | further names |")
    print("|---|---|---|---|---|---|")
    print("| " + " | ".join(str(s) for s in [options.cases, *sums]) + " |")
    print(f"\nof {seen} that these runs show with 95 %, {seen_right} are found")
    print(f"null cases: {alarms} names in {options.nulls} calls over {runs} runs")


if __name__ == "__main__":
    main()
