"""Trial logs and runs of ground robots, in and out of pandas."""

from __future__ import annotations

import os
from typing import Any, Mapping, Union

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


PATH_UNITS = {"t": "s", "x": "m", "y": "m", "theta": "rad"}


def _with_units(table: pd.DataFrame, units: Mapping[str, str]) -> pd.DataFrame:
    table.attrs["units"] = {k: u for k, u in units.items() if k in table.columns}
    return table


def read_table(file: Path) -> pd.DataFrame:
    """A CSV as pandas reads it, but numbers to the last digit, names as they are ("007", "NA"), and
    '#' is a comment only in lines before the header, as gapfarm has it."""
    with open(file, encoding="utf-8-sig", newline="") as text:
        marks = 0
        while is_comment(text.readline()):
            marks += 1
    names: Any = dict.fromkeys(("session", "run", "command"), str)
    return pd.read_csv(file, float_precision="round_trip", skiprows=marks, converters=names)


def is_comment(line: str) -> bool:
    return line.startswith("# log:") or (line.startswith("#") and "," not in line)


def read_trials(file: Path) -> pd.DataFrame:
    """A trial log (docs/formats.md): a row a trial, in the file's order; empty fields are NaN.

    session, trial, t (s since the session began), command, left and right (duties), duration (s),
    start pose x0, y0 (m), theta0 (rad), end pose x1, y1 (m), theta1 (rad), and further columns as the
    file has them. Nothing is checked: `gapfarm check` says what is wrong with a log.
    """
    table = read_table(file)
    return _with_units(table, TRIAL_UNITS)


def write_trials(trials: pd.DataFrame, file: Path) -> None:
    """Writes a trial log that gapfarm reads, a line a row; numbers keep all their digits.

    Columns and units as of read_trials().
    """
    trials.to_csv(file, index=False, na_rep="")


def read_paths(file: Path) -> pd.DataFrame:
    """Paths of a trial log, its paths.csv: a row a sample.

    session, trial, t (s since the command began), x, y (m), theta (rad) in the world.
    """
    table = read_table(file)
    return _with_units(table, PATH_UNITS)


def read_windows(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """A ground robot's logged runs (docs/formats.md): (commands, poses), a row a sample each.

    Both have run and t (s); commands a column a command channel of the robot, a row of which holds
    until the next one; poses x, y (m), theta (rad) of the marker in the world.
    """
    tables = []
    for name in ("commands.csv", "poses.csv"):
        table = read_table(os.path.join(folder, name))
        tables.append(_with_units(table, PATH_UNITS))
    return tables[0], tables[1]


def write_windows(commands: pd.DataFrame, poses: pd.DataFrame, folder: Path) -> None:
    """Writes runs into a folder that configs of scenario `ground` name, a line a row.

    Columns and units as of read_windows(); the folder is made if it is not there.
    """
    os.makedirs(folder, exist_ok=True)
    for name, table in (("commands.csv", commands), ("poses.csv", poses)):
        table.to_csv(os.path.join(folder, name), index=False, na_rep="")
