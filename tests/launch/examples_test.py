#!/usr/bin/env python3
"""examples_test.py BIN ROOT: runs every example of every `gapfarm COMMAND --help` in a folder with stand-ins
for the files that they name; long ones with --dry-run.  What is not run is named below, with the reason."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

BIN, ROOT = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()

NOT_RUN = {  # a part of the line: why
    "pushes.csv": "a log of pushes, with tips",
    "configs/push.toml": "a log of pushes, with tips",
    "warthog": "a ground robot's evolved run",
    "diagnose husky.toml": "a ground robot's runs",
    "waypoint_1.log": "a blendersim log",
    "export ros": "a ground robot's run or diagnosis",
    "drive.bag": "a bag",
    "drive.csv": "a table of somebody's logger",
    "--foreign": "somebody else's cases",
    "--watch": "goes on until it is stopped",
    "gapfarm serve": "goes on until it is stopped",
    "--genome 1284": "a run of so many members",
    "--listen tcp://0.0.0.0": "keys for others' machines",
    "keys ": "keys for others' machines",
    "effects configs/srv1.toml --figures": "simulates what its pictures show for a minute",
}


def gapfarm(*words, **options):
    environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "HOME": os.getcwd()}
    return subprocess.run(["gapfarm", *words], capture_output=True, text=True, env=environment, **options)


def examples():
    listed = gapfarm("completion", "words", "--", "").stdout.splitlines()
    for command in [line.split("\t")[0] for line in listed]:
        text = gapfarm(command, "--help").stdout
        for line in text.split("Examples:\n", 1)[-1].replace("\\\n", "").splitlines():
            if line.startswith("  gapfarm "):
                yield re.sub(r"\s+", " ", line.split("#")[0]).strip(), "--dry-run" in text


def make_stand_ins():
    os.symlink(ROOT / "configs", "configs")
    log = (ROOT / "configs/demo/trials.csv").read_text()
    for name in ("trials", "log", "monday", "tuesday", "logs/trials", "logs/monday"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(f"{name}.csv").write_text(re.sub(r"^s(\d+),", rf"{Path(name).stem}\1,", log, flags=re.M))
    rows = log.splitlines(keepends=True)
    for name in "ab":
        first = [re.sub(r"^s1,", f"{name},", row) for row in rows if not re.match(r"s[^1]", row)
                 or row.startswith("session")]
        Path(f"{name}.csv").write_text("".join(first))
    for folder in ("log", "logs"):
        Path(folder).mkdir(exist_ok=True)
        for day in range(12):
            Path(f"{folder}/{day}.dat").write_text(
                f"10.0;{day}.0;0.5;move(25.000000, 0.000000, 0.000000);30.0;{25 + day}.0;0.4\n")
    corpus = ROOT / "tests/fuzz/corpus"
    for name in ("husky", "burger", "old", "new"):
        shutil.copy(corpus / "urdf/car.urdf", f"{name}.urdf")
    shutil.copy(corpus / "controllers/ros1.yaml", "control.yaml")
    Path("monday").mkdir()
    for name in ("a", "b"):
        shutil.copy(ROOT / "configs/demo.toml", f"{name}.toml")
        text = Path(f"{name}.toml").read_text().replace("demo/trials.csv", "trials.csv")
        Path(f"{name}.toml").write_text(text)
    made = gapfarm("evolve", "configs/demo.toml", "--out", "run/demo", "--generations", "20",
                   "--population", "4", "--workers", "1")
    assert made.returncode == 0, made.stderr
    shutil.copytree("run/demo", "run/srv1")
    shutil.copy("run/demo/model.toml", "model.toml")
    made = gapfarm("diagnose", "configs/demo.toml", "--out", "diagnosis", "--workers", "1")
    assert made.returncode == 0, made.stderr


def main():
    failures, ran, used = 0, 0, set()
    make_stand_ins()
    for line, dry in examples():
        reasons = [part for part in NOT_RUN if part in line]
        used.update(reasons)
        if reasons:
            continue
        # An output of one example must not be in the way of the next.
        line = re.sub(r"(--out|--picture|--paths) (\S+)", lambda m: f"{m[1]} new{ran}/{Path(m[2]).name}", line)
        Path(f"new{ran}").mkdir()
        words = line.split("|")[0].split(">")[0] + (" --dry-run" if dry else "")
        done = subprocess.run(["sh", "-c", words], capture_output=True, text=True, timeout=120,
                              env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "HOME": os.getcwd()})
        ran += 1
        if done.returncode != 0:
            failures += 1
            print(f"FAILED with {done.returncode}: {words}\n{done.stderr}")
    for part in NOT_RUN.keys() - used:
        failures += 1
        print(f"FAILED: no example has '{part}' any more; take it off the list")
    print(f"examples: {ran} run, {failures} failures")
    return 1 if failures else 0


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    code = main()
    os.chdir("/")
sys.exit(code)
