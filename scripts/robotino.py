#!/usr/bin/env python3
"""Asks what changed between floors, directions and speeds of a Robotino, and where floors meet.

    scripts/robotino.py DATA OUT [PAIR...]

DATA holds runs.csv (file, floor, speed_m_s, direction_deg) and the logs that it names. A PAIR is
BEFORE:AFTER, or AFTER alone for a diagnosis without a reference; each is a floor, with @SPEED for
one speed and /even or /odd for every second direction. The tables of docs/evidence/ground_diagnosis.md are what it
prints. BIN: where the programs are (build/release/bin).
"""
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROBOT = ROOT / "configs/robots/robotino.toml"
MAP = ROOT / "configs/robots/robotino_map.toml"
PROGRAM = pathlib.Path(os.environ.get("BIN", ROOT / "build/release/bin")) / "gapfarm"
PAIRS = ["table:gray@0.1", "table:green", "gray@0.1:green", "gray@0.1:table",
         "table/even:table/odd", "gray@0.1/even:gray@0.1/odd", "gray@0.2/even:gray@0.2/odd",
         "green/even:green/odd", "gray@0.1:gray@0.2", "table:table_gray", "table_gray"]


def run(*command):
    """Runs the program; its standard output, or the end of everything with what it said."""
    done = subprocess.run([PROGRAM, *command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"gapfarm {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def files_of(data, name):
    """Logs of a set: FLOOR, FLOOR@SPEED, either with /even or /odd directions."""
    floor, speed, part = re.fullmatch(r"([^@/]+)(?:@([\d.]+))?(?:/(even|odd))?", name).groups()
    with open(data / "runs.csv", encoding="utf-8") as text:
        rows = [row for row in csv.DictReader(text) if row["floor"] == floor]
    rows = [row for row in rows if not speed or float(row["speed_m_s"]) == float(speed)]
    directions = sorted({float(row["direction_deg"]) for row in rows})
    chosen = [row for row in rows if not part or
              directions.index(float(row["direction_deg"])) % 2 == ["even", "odd"].index(part)]
    if not chosen:
        sys.exit(f"runs.csv has no runs of {name}")
    return [data / row["file"] for row in chosen]


def import_set(data, out, name):
    """The folder of a set's runs, imported if it is not there."""
    folder = out / "runs" / name.replace("/", "_")
    if not (folder / "poses.csv").exists():
        run("import", "runs", *files_of(data, name), "--map", MAP, "--out", folder)
    return folder


def diagnose(out, data, pair):
    """The diagnosis of a pair, and the seconds that it took."""
    before, _, after = pair.rpartition(":")
    folder = out / pair.replace("/", "_").replace(":", "_to_")
    shutil.rmtree(folder, ignore_errors=True)
    config = out / (folder.name + ".toml")
    config.write_text(f'scenario = "ground"\n[robot]\nfile = "{ROBOT}"\n[runs]\n'
                      f'folders = ["{import_set(data, out, after)}"]\n', encoding="utf-8")
    reference = ["--reference", import_set(data, out, before)] if before else []
    start = time.monotonic()
    run("diagnose", config, *reference, "--out", folder)
    with open(folder / "diagnosis.json", encoding="utf-8") as text:
        return json.load(text), time.monotonic() - start


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    data, out = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    out.mkdir(parents=True, exist_ok=True)
    print("| from | to | named | what it says | verdict | s |\n|---|---|---|---|---|---|")
    for pair in sys.argv[3:] or PAIRS:
        said, seconds = diagnose(out, data, pair)
        before, _, after = pair.rpartition(":")
        names = ", ".join(effect["name"] for effect in said["effects"]) or "nothing"
        words = " ".join(effect["text"] for effect in said["effects"]) or said["headline"]
        loop = [caution for caution in said["cautions"] if "set speed" in caution]
        print(f"| {before} | {after} | {names} | {' '.join([words, *loop])} | {said['verdict']} "
              f"| {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
