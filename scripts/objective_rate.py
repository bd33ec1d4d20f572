#!/usr/bin/env python3
"""Evaluations a second of an objective that costs nothing, as a table: what the farm itself can do.

    GAPFARM=build/release/bin/gapfarm scripts/objective_rate.py [FOLDER...]

Runs are kept in each FOLDER in turn (the temporary one, and memory): a generation is on the disk before the next begins.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

BRIDGES = Path(__file__).resolve().parent / "bridges"
EVALUATIONS = 6000


def rate(folder, program, population, workers):
    config = folder / "rate.toml"
    config.write_text(f'scenario = "objective"\n[objective]\nprogram = {json.dumps(program)}\n'
                      f'[evolution]\npopulation = {population}\n'
                      f'[evolution.stop]\nevaluations = {EVALUATIONS}\ngenerations = {EVALUATIONS}\n')
    words = ["evolve", config, "--out", folder / f"{population}_{workers}", "--workers", str(workers), "--json"]
    done = json.loads(subprocess.run([os.environ.get("GAPFARM", "gapfarm"), *words], check=True,
                                     stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout)
    return done["evaluations"] / done["wall_s"], 1e3 * done["wall_s"] / done["generations"]


print("| program | run in | population | workers | evaluations a second | ms a generation |\n|---|---|---|---|---|---|")
for place in sys.argv[1:] or [tempfile.gettempdir(), "/dev/shm"]:
    with tempfile.TemporaryDirectory() as built:
        compiled = str(Path(built) / "rosenbrock")
        subprocess.run(["g++", "-std=c++17", "-O2", "-o", compiled, BRIDGES / "rosenbrock.cc"], check=True)
        for name, program in (("Python", ["python3", str(BRIDGES / "rosenbrock.py")]), ("C++", [compiled])):
            for population in (40, 1000):
                for workers in (1, 2):
                    with tempfile.TemporaryDirectory(dir=place) as folder:
                        a_second, generation_ms = rate(Path(folder), program, population, workers)
                    print(f"| {name} | {place} | {population} | {workers} | {a_second:.0f} | {generation_ms:.1f} |",
                          flush=True)
