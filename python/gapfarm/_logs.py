"""Trial logs and runs of ground robots, in and out of pandas."""

from __future__ import annotations

import os
from typing import Union

import pandas as pd

Path = Union[str, "os.PathLike[str]"]

TRIAL_UNITS = {
    "t": "s",
    "duration": "s",
    "x0": "m",
    "y0": "m",
    "theta0": "rad",
    "x1": "m",
    "y1": "m",
    "theta1": "rad",
}


def read_trials(file: Path) -> pd.DataFrame:
    """A trial log (docs/formats.md): a row a trial, poses in m and rad; empty fields are NaN."""
    table = pd.read_csv(file, comment="#", dtype={"session": str, "command": str})
    table.attrs["units"] = {k: u for k, u in TRIAL_UNITS.items() if k in table.columns}
    return table


def write_trials(trials: pd.DataFrame, file: Path) -> None:
    """Writes a trial log that gapfarm reads; numbers keep all their digits."""
    trials.to_csv(file, index=False, na_rep="")


def read_windows(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """A ground robot's logged run (docs/ground.md): (commands, poses), a row a sample."""
    commands = pd.read_csv(os.path.join(folder, "commands.csv"), comment="#")
    poses = pd.read_csv(os.path.join(folder, "poses.csv"), comment="#")
    return commands, poses
