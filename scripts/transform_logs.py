#!/usr/bin/env python3
"""Spoils good logs in every usual way and looks at what the diagnosis says.

    scripts/transform_logs.py --out run/spoiled --truth TRUTHS CASE...

CASE is a folder with a trials.csv of the srv1 scenario, TRUTHS a folder with CASE.json (its key
"effects" names what is in it).  Every log is written to OUT/CASE/HOW/trials.csv and diagnosed there;
one that is there already is not diagnosed again.  Prints a table: how a log was changed, how many,
how many crashed, named something false, and said what was expected.  Exits 0 when none crashed and
none named anything false.  Standard library only.
"""
import argparse
import collections
import csv
import json
import math
import os
import random
import subprocess
import sys

PI = math.pi


def wrapped(angle):
    return angle - 2 * PI * math.ceil((angle - PI) / (2 * PI))


def poses(change):
    """A change of every pose."""
    def apply(rows, _):
        for row in rows:
            for k in "01":
                x, y, a = change(*(float(row[c + k]) for c in ("x", "y", "theta")))
                row["x" + k], row["y" + k], row["theta" + k] = repr(x), repr(y), repr(wrapped(a))
        return rows
    return apply


def degrees(rows, _):
    for row in rows:
        for k in ("theta0", "theta1"):
            row[k] = repr(math.degrees(float(row[k])))
    return rows


def swapped_sides(rows, _):
    for row in rows:
        row["left"], row["right"] = row["right"], row["left"]
    return rows


def last_session(change):
    def apply(rows, rng):
        own = [row for row in rows if row["session"] == rows[-1]["session"]]
        change(own, rng)
        return rows
    return apply


def other_commands(rows, rng):
    drawn = [dict(row) for row in rows]
    rng.shuffle(drawn)
    for row, other in zip(rows, drawn):
        for c in ("command", "left", "right", "duration"):
            row[c] = other[c]
    return rows


def thinned(count):
    def apply(rows, rng):
        kept = sorted(rng.sample(range(len(rows)), min(count, len(rows))))
        return [rows[i] for i in kept]
    return apply


def damaged(rows, rng):
    for i in rng.sample(range(len(rows)), max(1, len(rows) // 100)):
        row = rows[i]
        kind = rng.randrange(5)
        if kind == 0:
            row["x1"] = repr(10 * float(row["x1"]))
        elif kind == 1:
            row["theta1"] = repr(rng.uniform(-3.1, 3.1))
        elif kind == 2:
            row["x0"], row["y0"] = row["y0"], row["x0"]
        elif kind == 3:
            row["x1"], row["y1"], row["theta1"] = "0", "0", "0"
        else:
            row["y0"] = repr(float(row["y0"]) + 1)
    return rows


def backward(rows, _):
    last = max(float(row["t"] or 0) for row in rows)
    for row in rows:
        row["t"] = repr(last - float(row["t"] or 0))
    return rows


def still(rows, _):
    for row in rows:
        for c in ("x", "y", "theta"):
            row[c + "1"] = row[c + "0"]
    return rows


# What is expected: "same" verdict and names as of the untouched log, "true" names or none, a finding
# of the sanity stage, or "refused" by the reader.
HOW = {
    "untouched": (lambda rows, _: rows, "same"),
    "shifted 5 km": (poses(lambda x, y, a: (x + 5000, y - 3000, a)), "same"),
    "turned 90 degrees": (poses(lambda x, y, a: (-y, x, a + PI / 2)), "same"),
    "damaged 1 %": (damaged, "true"),
    "thinned to 40": (thinned(40), "true"),
    "thinned to 10": (thinned(10), "too_few_trials"),
    "thinned to 1": (thinned(1), "too_few_trials"),
    "centimetres": (poses(lambda x, y, a: (100 * x, 100 * y, a)), "unit_error"),
    "millimetres": (poses(lambda x, y, a: (1000 * x, 1000 * y, a)), "unit_error"),
    "inches": (poses(lambda x, y, a: (x / 0.0254, y / 0.0254, a)), "unit_error"),
    "radians twice": (poses(lambda x, y, a: (x, y, math.radians(a))), "unit_error"),
    "degrees": (degrees, "refused"),
    "y mirrored": (poses(lambda x, y, a: (x, -y, a)), "axis_mirrored"),
    "x mirrored": (poses(lambda x, y, a: (-x, y, a)), "axis_mirrored"),
    "x and y swapped": (poses(lambda x, y, a: (y, x, a)), "axes_swapped"),
    "headings clockwise": (poses(lambda x, y, a: (x, y, -a)), "heading_flipped"),
    "compass headings": (poses(lambda x, y, a: (x, y, PI / 2 - a)), "heading_flipped"),
    "front for back": (poses(lambda x, y, a: (x, y, a + PI)), "heading_turned"),
    "sides swapped": (swapped_sides, "sides_swapped"),
    "sides swapped in one session": (last_session(swapped_sides), "sides_swapped"),
    "commands of other rows": (other_commands, "commands_unrelated"),
    "time backward": (backward, "refused"),
    "standing still": (still, "no_motion"),
}


def diagnose(options, log, folder):
    report = os.path.join(folder, "diagnosis.json")
    if not os.path.exists(report):
        command = [options.gapfarm, "diagnose", options.config, "--trials", log, "--out", folder]
        if options.workers:
            command += ["--workers", str(options.workers)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode == 2:
            return {"verdict": "refused", "effects": []}
        if done.returncode != 0 or not os.path.exists(report):
            print(f"crashed ({done.returncode}): {log}\n{done.stderr}", file=sys.stderr)
            return None
    with open(report) as file:
        return json.load(file)


def false_names(said, true):
    """Effects of the catalogue that are not there, neither they nor one of their aliases."""
    return [e["name"] for e in said["effects"]
            if not ({e["name"], *e["aliases"]} & true) and said["verdict"] != "unusable"]


def as_expected(expected, said, untouched, true):
    findings = {f["name"] for f in said.get("sanity", []) if f["severity"] == "unusable"}
    if expected == "refused":
        return said["verdict"] == "refused"
    if expected == "true":
        return said["verdict"] != "unusable" or bool(findings)
    if expected != "same":
        return said["verdict"] == "unusable" and expected in findings
    names = [e["name"] for e in said["effects"]]
    return (said["verdict"], names) == (untouched["verdict"],
                                        [e["name"] for e in untouched["effects"]])


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="+", metavar="CASE")
    parser.add_argument("--out", required=True)
    parser.add_argument("--truth", required=True)
    parser.add_argument("--gapfarm", default="build/dev/bin/gapfarm")
    parser.add_argument("--config", default="configs/srv1.toml")
    parser.add_argument("--how", nargs="*", help="only these changes")
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    rows_of = collections.defaultdict(lambda: collections.Counter())
    for case in options.cases:
        name = os.path.basename(os.path.normpath(case))
        with open(os.path.join(options.truth, name + ".json")) as file:
            true = set(json.load(file)["effects"])
        untouched = None
        for how, (change, expected) in HOW.items():
            if options.how and how not in options.how and how != "untouched":
                continue
            folder = os.path.join(options.out, name, how.replace(" ", "_").replace("%", "percent"))
            os.makedirs(folder, exist_ok=True)
            log = os.path.join(folder, "trials.csv")
            with open(os.path.join(case, "trials.csv"), newline="") as file:
                reader = csv.DictReader(file)
                rows, columns = list(reader), reader.fieldnames
            rows = change(rows, random.Random(name + how))
            with open(log, "w", newline="") as file:
                writer = csv.DictWriter(file, columns)
                writer.writeheader()
                writer.writerows(rows)
            said = diagnose(options, log, os.path.join(folder, "d"))
            count = rows_of[how]
            count["logs"] += 1
            if said is None:
                count["crashed"] += 1
                continue
            if how == "untouched":
                untouched = said
            wrong = false_names(said, true)
            count["false"] += bool(wrong)
            right = as_expected(expected, said, untouched or said, true)
            count["expected"] += right
            if wrong or not right:
                print(f"{name}, {how}: {said['verdict']} "
                      f"{[e['name'] for e in said['effects']]}, truth {sorted(true)}",
                      file=sys.stderr)
    total = collections.Counter()
    print("| how | logs | crashed | a false name | as expected |\n|---|---|---|---|---|")
    for how, count in rows_of.items():
        total += count
        print(f"| {how} | {count['logs']} | {count['crashed']} | {count['false']} | "
              f"{count['expected']} |")
    print(f"| all | {total['logs']} | {total['crashed']} | {total['false']} | "
          f"{total['expected']} |")
    return 1 if total["crashed"] or total["false"] else 0


if __name__ == "__main__":
    sys.exit(main())
