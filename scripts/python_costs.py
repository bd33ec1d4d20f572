#!/usr/bin/env python3
"""What a call of the Python package costs beside the simulation itself, as medians of ten calls.

    PYTHONPATH=python GAPFARM=build/release/bin/gapfarm scripts/python_costs.py
"""

import statistics
import tempfile
import time
from pathlib import Path

import gapfarm

ROOT = Path(__file__).parents[1]


def median_ms(call):
    times = []
    for _ in range(10):
        begun = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - begun))
    return statistics.median(times)


with tempfile.TemporaryDirectory() as folder:
    log = gapfarm.read_trials(ROOT / "configs/demo/trials.csv")
    run = gapfarm.evolve(ROOT / "configs/demo.toml", Path(folder) / "run", "--generations", "1",
                         "--population", "4", "--workers", "1")
    print(f"the program starts and ends      {median_ms(gapfarm.version):7.1f} ms")
    print(f"a run's generations are read     {median_ms(lambda: run.generations):7.1f} ms")
    print(f"predict 1 trial                  {median_ms(lambda: run.model.predict(log[:1], workers=1)):7.1f} ms")
    whole = median_ms(lambda: run.model.predict(log, workers=1))
    print(f"predict {len(log)} trials               {whole:7.1f} ms")
    many = gapfarm.read_trials(ROOT / "configs/demo/trials.csv")
    repeated = many.loc[many.index.repeat(50)].reset_index(drop=True)
    repeated["trial"] = range(len(repeated))
    print(f"predict {len(repeated)} trials              {median_ms(lambda: run.model.predict(repeated, workers=1)):7.1f} ms")
