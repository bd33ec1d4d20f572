#!/usr/bin/env python3
"""examples_test.py BIN ROOT: runs every example of every `gapfarm ... --help` in a folder with stand-ins
for the files that they name; long ones with --dry-run, and what does not end by itself until it is stopped."""

import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

BIN, ROOT = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()

ENDLESS = ("gapfarm serve", "--watch")
AS = {  # what a stand-in is called, or has
    "--genome 1284": "--genome 9",
    "push_triangle.toml --trials pushes.csv": "push_triangle.toml --trials wood/pushes.csv",
    "--key KEY": "--key \"$(sed -n 's/^public //p' rack4.pub)\"",
    "export ros diagnosis": "export ros grounded",
}


def gapfarm(*words, **options):
    environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "HOME": os.getcwd()}
    return subprocess.run(["gapfarm", *words], capture_output=True, text=True, env=environment, **options)


def commands(before=()):
    """Every command, a tuple of words, those below others after them."""
    for line in gapfarm("completion", "words", "--", *before, "").stdout.splitlines():
        words = (*before, line.split("\t")[0])
        if words[0] in ("help",) or len(words) > 2:
            continue
        text = gapfarm(*words, "--help")
        if text.returncode == 0 and f"Usage: gapfarm {' '.join(words)}" in text.stdout:
            yield words
            if re.search(r"^  \w+ +\S", text.stdout.split("Subcommands:", 1)[-1], re.M) and len(words) == 1:
                yield from commands(words)


def examples():
    seen = set()
    for words in [(), *commands()]:
        text = gapfarm(*words, "--help").stdout
        for line in text.split("Examples:\n", 1)[-1].replace("\\\n", "").splitlines():
            indented, line = line.startswith("  "), re.sub(r"\s+", " ", line.split(" #")[0]).strip()
            if indented and line.startswith("gapfarm ") and line not in seen:
                seen.add(line)
                command = line.split()[1]
                yield line, "--dry-run" in gapfarm(command, "--help").stdout


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
    shutil.copy(corpus / "ros1_bag/ros1_none.bag", "drive.bag")
    shutil.copy(corpus / "text_log/headed.csv", "drive.csv")
    Path("waypoint_1.log").write_text(
        "10:00:00:000:000 [ SENT ] CAMPOSE 7 10 20 0.5 [ TO ] robot 7\n"
        "10:00:00:500:000 [ RECIEVED ] WAYPOINTS 7 1 30 20 [ FROM ] robot 7\n"
        "10:00:01:000:000 [ SENT ] CAMPOSE 7 30 20 0.25 [ TO ] robot 7\n")
    for name in ("a", "b"):
        shutil.copy(ROOT / "configs/demo.toml", f"{name}.toml")
        text = Path(f"{name}.toml").read_text().replace("demo/trials.csv", "trials.csv")
        Path(f"{name}.toml").write_text(text)
    for day in ("monday", "tuesday", "friday", "held_out"):
        make_runs(Path(day))
    make("evolve", "configs/demo.toml", "--out", "run/demo", "--generations", "20", "--population", "4")
    shutil.copytree("run/demo", "run/srv1")
    shutil.copy("run/demo/model.toml", "model.toml")
    make("report", "run/demo", "--out", "run.html", "--history", "candidates.csv", workers=())
    make("diagnose", "configs/demo.toml", "--out", "diagnosis")
    make("init", "husky.urdf", "control.yaml", "monday", "--out", "husky.toml", workers=())
    shutil.copy("husky.toml", "warthog.toml")
    make("evolve", "husky.toml", "--out", "run/husky", "--generations", "1", "--population", "4")
    shutil.copytree("run/husky", "run/warthog")
    make("diagnose", "husky.toml", "--out", "grounded")
    for day in ("monday", "friday"):
        shutil.copytree(day, f"fleet/first/{day}")
    shutil.copy("husky_robot.toml", "fleet/robot.toml")
    make_pushes()
    Path("logs/cases/one").mkdir(parents=True)
    shutil.copy("trials.csv", "logs/cases/one/trials.csv")
    Path("logs/cases/truth").mkdir()
    made = gapfarm("keys", "make", "--worker", "--name", "rack4", "--keys", "theirs")
    assert made.returncode == 0, made.stderr
    shutil.copy("theirs/worker.pub", "rack4.pub")


def make(*words, workers=("--workers", "1")):
    made = gapfarm(*words, *workers)
    assert made.returncode == 0, made.stderr


def make_runs(folder):
    """A run of a robot on two sides, as its kinematics have it."""
    folder.mkdir()
    (folder / "commands.csv").write_text("run,t,v,omega\na,0,0.2,0.2\na,4,0.1,-0.3\na,8,0,0\n")
    x = y = theta = 0
    rows = ["run,t,x,y,theta"]
    for i in range(240):
        rows.append(f"a,{i / 20},{x:.5f},{y:.5f},{theta:.5f}")
        v, omega = (0.2, 0.2) if i < 80 else (0.1, -0.3) if i < 160 else (0, 0)
        x, y, theta = x + v / 20 * math.cos(theta), y + v / 20 * math.sin(theta), theta + omega / 20
    (folder / "poses.csv").write_text("\n".join(rows) + "\n")


def make_pushes():
    """Pushes of all objects, and of the triangle on wood, from where the examples have them begin."""
    starts = (0.11, 0.13, 0.15, 0.18, 0.21)
    Path("wood").mkdir()
    for config, log, session in (("push", "pushes.csv", "s1"), ("push_triangle", "wood/pushes.csv", "wood")):
        make("simulate", f"configs/{config}.toml", "--out", log, "--sessions", "1", "--trials", "60")
        tips = Path(log).with_name("tips.csv")
        tips.write_text(re.sub("^s1", session, tips.read_text(), flags=re.M))
        head, *rows = Path(log).read_text().splitlines()
        rows = [re.sub("^s1", session, row) + f",{starts[i % 5]}" for i, row in enumerate(rows)]
        Path(log).write_text("\n".join([head + ",start", *rows]) + "\n")


def run_until_stopped(words):
    """Starts it, waits for its first line, stops it as Ctrl-C does: (exit code, what it said)."""
    environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "HOME": os.getcwd()}
    with subprocess.Popen(words.split(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env=environment) as process:
        said = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        said += process.communicate(timeout=60)[0]
        # A watched run that has ended ends the command, too, maybe just before it is stopped.
        ends = (0, 128 + signal.SIGINT) + ((-signal.SIGINT,) if "--watch" in words else ())
        stopped = said and process.returncode in ends
        return 0 if stopped else process.returncode or 1, said


def main():
    failures, ran = 0, 0
    make_stand_ins()
    # Keys come first: others are let in by them.
    for line, dry in sorted(examples(), key=lambda example: "gapfarm keys" not in example[0]):
        for part, stands_in in AS.items():
            line = line.replace(part, stands_in)
        # An output of one example must not be in the way of the next.
        line = re.sub(r"(--out|--config|--picture|--paths) (\S+)", lambda m: f"{m[1]} new{ran}/{Path(m[2]).name}", line)
        Path(f"new{ran}").mkdir()
        words = line.split("|")[0]
        if dry:  # an option of the command's own, before what it hands on
            words = words.replace(" -- ", " --dry-run -- ", 1) if " -- " in words else words + " --dry-run"
        ran += 1
        if any(part in line for part in ENDLESS):
            code, said = run_until_stopped(words)
        else:
            done = subprocess.run(["sh", "-c", words], capture_output=True, text=True, timeout=120,
                                  env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "HOME": os.getcwd()})
            code, said = done.returncode, done.stderr
        if code != 0:
            failures += 1
            print(f"FAILED with {code}: {words}\n{said}")
    print(f"examples: {ran} run, {failures} failures")
    return 1 if failures else 0


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    code = main()
    os.chdir("/")
sys.exit(code)
