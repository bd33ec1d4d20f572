"""Runs: what evolution has committed, read from the run store."""

from __future__ import annotations

import contextlib
import json
import operator
import os
import sqlite3
import urllib.parse
from typing import Any, Optional, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from ._model import Model
from ._program import Progress, command, files

_SCHEMA = 5
_FIRST_WITH_INCIDENTS = 2
_FIRST_WITH_OBJECTIVES = 5


class Run:
    """A run's folder.  Every property reads the store anew, so a run that goes on can be watched.

    Holds nothing but the path: pickles, and may be used from several threads.
    """

    def __init__(self, folder: "str | os.PathLike[str]"):
        self.folder = os.fspath(folder)
        store = os.path.join(self.folder, "run.sqlite")
        if not os.path.exists(store):
            raise FileNotFoundError(f"{store}: there is no run")
        with self._open() as db:
            (schema,) = db.execute("PRAGMA user_version").fetchone()
        if schema > _SCHEMA:
            raise ValueError(f"{store}: schema {schema}, this package knows up to {_SCHEMA}")

    def __repr__(self) -> str:
        return f"gapfarm.Run({self.folder!r})"

    def _open(self) -> "contextlib.closing[sqlite3.Connection]":
        # A reader that keeps its transaction open would make the master wait.
        path = os.path.abspath(os.path.join(self.folder, "run.sqlite"))
        uri = f"file:{urllib.parse.quote(path)}?mode=ro"
        return contextlib.closing(sqlite3.connect(uri, uri=True, timeout=60))

    def _table(self, query: str, values: Sequence[Any] = ()) -> pd.DataFrame:
        with self._open() as db:
            return pd.read_sql_query(query, db, params=list(values))

    @property
    def info(self) -> dict[str, Any]:
        """What was fixed at the start: config, seed, fitness and its unit, build, ..."""
        row = self._table(
            "SELECT program_version, fingerprint, created, config_path, config, overrides, "
            "problem_hash, seed, numeric_class, fitness, fitness_unit, higher_is_better FROM run"
        ).iloc[0]
        info = {str(k): v for k, v in row.items()}
        info["seed"] = int(info["seed"])
        info["overrides"] = json.loads(info["overrides"])
        info["higher_is_better"] = bool(info["higher_is_better"])
        return info

    @property
    def generations(self) -> pd.DataFrame:
        """A row a generation: best, mean, median, worst fitness (in info["fitness_unit"]), diversity,
        evaluations since the start, wall_s of it (s), quarantined, digest; indexed by generation."""
        table = self._table(
            "SELECT generation, best, mean, median, worst, diversity, evaluations, wall_s, "
            "quarantined, digest FROM generations ORDER BY generation"
        ).set_index("generation")
        unit = self.info["fitness_unit"]
        table.attrs["units"] = dict.fromkeys(("best", "mean", "median", "worst"), unit)
        table.attrs["units"]["wall_s"] = "s"
        return table

    def individuals(self, generation: Optional[int] = None) -> pd.DataFrame:
        """A row a member of a generation (default: the last; 0: of all), best first: rank, birth_id,
        fitness (NaN unless the outcome is OK), outcome, scores, operators, then a column a parameter,
        SI units, and of several objectives a column each, named "objective.NAME"."""
        where, values = "", []  # type: tuple[str, list[int]]
        if generation is None:
            where = "WHERE generation = (SELECT max(generation) FROM generations)"
        elif generation != 0:
            where, values = "WHERE generation = ?", [self._committed(generation)]
        table = self._table(
            "SELECT generation, rank, birth_id, fitness, outcome, scores, operators, parameters, "
            f"{self._objectives()} AS objectives FROM individuals {where} ORDER BY generation, rank",
            values,
        )
        parameters = pd.DataFrame([json.loads(p) for p in table.pop("parameters")])
        objectives = pd.DataFrame([json.loads(o or "{}") for o in table.pop("objectives")])
        return pd.concat([table, parameters, objectives.add_prefix("objective.")], axis=1)

    def _committed(self, generation: int) -> int:
        number = operator.index(generation)  # numpy's, too
        with self._open() as db:
            (last,) = db.execute("SELECT max(generation) FROM generations").fetchone()
        if not 1 <= number <= (last or 0):
            raise ValueError(f"{self.folder} has no generation {number}, its last is {last or 0}")
        return number

    def _objectives(self) -> str:
        with self._open() as db:
            (schema,) = db.execute("PRAGMA user_version").fetchone()
        return "''" if schema < _FIRST_WITH_OBJECTIVES else "objectives"

    @property
    def history(self) -> pd.DataFrame:
        """A row an individual in the order of birth, as it first appeared, like individuals(), with
        evaluations and wall_s (s) that the run had spent by the end of its generation."""
        table = self.individuals(0).drop_duplicates("birth_id").sort_values("birth_id")
        spent = self.generations[["evaluations", "wall_s"]]
        spent = spent.assign(wall_s=spent.wall_s.cumsum())
        return table.join(spent, on="generation").reset_index(drop=True)

    @property
    def importance(self) -> pd.DataFrame:
        """A row a parameter, a column the fitness or each objective: the share of its variance that
        the parameter explains alone, [0, 1] without a unit, among what was evaluated (docs/page.md);
        NaN where that was too little."""
        found = command(["report", self.folder, "--out", os.devnull]).get("importance", {})
        return pd.DataFrame.from_dict(found, orient="index", dtype=float)

    def genomes(self, generation: Optional[int] = None) -> npt.NDArray[np.float64]:
        """float64 of shape (individuals, genes), values in [0, 1], best first."""
        which = "(SELECT max(generation) FROM generations)" if generation is None else "?"
        with self._open() as db:
            rows = db.execute(
                f"SELECT genome FROM individuals WHERE generation = {which} ORDER BY rank",
                [] if generation is None else [self._committed(generation)],
            ).fetchall()
        return np.array([np.frombuffer(genome, dtype=np.float64) for (genome,) in rows])

    @property
    def best(self) -> pd.Series:
        """The best member of the last generation, as in individuals()."""
        return self.individuals().iloc[0]

    @property
    def incidents(self) -> pd.DataFrame:
        """What somebody should look at, a row an incident: generation, kind, time (UTC), text."""
        with self._open() as db:
            (schema,) = db.execute("PRAGMA user_version").fetchone()
        if schema < _FIRST_WITH_INCIDENTS:  # of 0.1: read as it is
            return pd.DataFrame(columns=["generation", "kind", "time", "text"])
        table = self._table("SELECT generation, kind, time, text FROM incidents ORDER BY time")
        table["time"] = pd.to_datetime(table["time"], unit="s", utc=True)
        return table

    def status(self) -> dict[str, Any]:
        """`gapfarm status RUN --json` (docs/formats.md)."""
        found: dict[str, Any] = command(["status", self.folder])
        return found

    @property
    def model(self) -> Model:
        """What the run wrote, or its best so far."""
        return Model(self.folder)


def evolve(
    config: "str | os.PathLike[str]",
    out: "str | os.PathLike[str]",
    *options: str,
    trials: "str | os.PathLike[str] | Sequence[str | os.PathLike[str]]" = (),
    progress: Optional[Progress] = None,
) -> Run:
    """`gapfarm evolve CONFIG --out OUT`; `options` are more of its words ("--workers", "4").

    Raises GapfarmError; one of exit code 85 was stopped and can be resumed."""
    words: list[str] = ["evolve", os.fspath(config), "--out", os.fspath(out), *options]
    command(words + files("--trials", trials), progress)
    return Run(out)
