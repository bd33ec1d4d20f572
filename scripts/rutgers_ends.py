#!/usr/bin/env python3
"""How near the mecanum robot's runs end, beside the simulation that its owners tuned by hand.

    scripts/rutgers_ends.py DATA OUT

DATA holds rutgers_mecanum/; OUT is where scripts/measure_ground.sh left the sets rutgers_of_nine_1 to
rutgers_of_nine_9 (each command predicted by a fit to the eight others) and rutgers_all (all fitted).
What was not measured is excluded.  The same for all: from the first frame to the last one of the
recording, every take on its own.  Needs only the standard library.
"""
import csv
import math
import os
import statistics
import sys


def last_pose(path):
    with open(path, newline="", encoding="utf-8") as file:
        row = list(csv.DictReader(file))[-1]
    return tuple(float(row[key]) for key in ("x", "y", "theta"))


def apart(a, b):
    """mm and degrees."""
    turn = (a[2] - b[2] + math.pi) % (2 * math.pi) - math.pi
    return 1e3 * math.hypot(a[0] - b[0], a[1] - b[1]), math.degrees(abs(turn))


def windows_table(out):
    """Medians over the windows of all nine predictions, as `gapfarm horizons` has them of one."""
    windows = {}
    for k in range(9):
        path = os.path.join(out, f"rutgers_of_nine_{k + 1}.csv")
        if not os.path.exists(path):
            continue
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                windows.setdefault(row["horizon"], []).append(row)
    print("\n| s | windows | gapfarm mm, mrad | kinematics mm, mrad | constant velocity mm, mrad |")
    print("|---|---|---|---|---|")
    for horizon, rows in windows.items():
        cells = [", ".join(f"{1e3 * statistics.median(float(row[kind + part]) for row in rows):.1f}"
                           for part in ("position", "heading"))
                 for kind in ("", "kinematics_", "constant_")]
        name = "whole" if float(horizon) == 0 else horizon
        print(f"| {name} | {len(rows)} | {' | '.join(cells)} |")


def predicted(path):
    """(mm, degrees) of every whole run, in driving order; none where it was not measured."""
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return [(1e3 * float(row["position"]), math.degrees(float(row["heading"])))
                for row in csv.DictReader(file) if float(row["horizon"]) == 0]


def cell(errors):
    return "; ".join(f"{mm:.0f}, {degrees:.1f}" for mm, degrees in errors)


def line(name, errors):
    if not errors:
        return
    mm, degrees = zip(*errors)
    print(f"| {name} | {len(errors)} | {statistics.median(mm):.1f}, {statistics.median(degrees):.1f} "
          f"| {statistics.mean(mm):.1f}, {statistics.mean(degrees):.1f} |")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    data, out = sys.argv[1:]
    folder = os.path.join(data, "rutgers_mecanum")
    with open(f"{folder}/takes.csv", newline="", encoding="utf-8") as file:
        takes = list(csv.DictReader(file))
    with open(f"{folder}/pybullet_ends.csv", newline="", encoding="utf-8") as file:
        by_hand = {int(row["take"]): tuple(float(row[key]) for key in ("x", "y", "theta"))
                   for row in csv.DictReader(file)}
    everything = predicted(os.path.join(out, "rutgers_all.csv"))
    own, fitted, theirs, beside, beside_fitted, repeats = [], [], [], [], [], []
    columns = ["command", "held out mm, deg", *(["fitted mm, deg"] if everything else []),
               "by hand mm, deg", "repeats apart mm, deg"]
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for k in range(len(takes) // 2):
        pair = takes[2 * k:2 * k + 2]
        ends = [last_pose(f"{folder}/take{int(take['take']):02d}_poses.csv") for take in pair]
        held = predicted(os.path.join(out, f"rutgers_of_nine_{k + 1}.csv"))
        known = everything[2 * k:2 * k + 2]
        hand = by_hand.get(int(pair[0]["take"]))
        hand = [apart(hand, end) for end in ends] if hand else []
        own += held
        fitted += known
        repeats.append(apart(*ends))
        if hand:
            theirs += hand
            beside += held
            beside_fitted += known
        words = " ".join(pair[0][f"w{i}"] for i in (1, 2, 3, 4))
        cells = [held, *([known] if everything else []), hand, repeats[-1:]]
        print(f"| {words} | {' | '.join(cell(errors) for errors in cells)} |")
    print("\n| ends | takes | median mm, deg | mean mm, deg |")
    print("|---|---|---|---|")
    line("held out", own)
    line("held out, of the commands tuned by hand", beside)
    line("fitted", fitted)
    line("fitted, of the commands tuned by hand", beside_fitted)
    line("tuned by hand", theirs)
    line("repeats, one from the other", repeats)
    windows_table(out)


if __name__ == "__main__":
    main()
