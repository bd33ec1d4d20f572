"""Models: parameters, predictions, simulated logs."""

from __future__ import annotations

import os
import sys
import tempfile
from typing import Any, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt
import pandas as pd

from ._logs import Path, read_paths, read_table, read_trials, write_trials
from ._program import command

if sys.version_info >= (3, 11):
    import tomllib as _toml
else:
    import tomli as _toml

_UNITS = {"x": "m", "y": "m", "theta": "rad", "log_score": "nats"}


class Model:
    """A model.toml, or a folder with one: of a run or a diagnosis.

    Simulations are done by local workers, as `gapfarm predict` and `gapfarm simulate` do.  Holds nothing
    but the path: pickles, and may be used from several threads.
    """

    def __init__(self, path: Path):
        self.path = os.fspath(path)
        if not os.path.exists(self.path):
            raise FileNotFoundError(f"{self.path}: there is no model")

    def __repr__(self) -> str:
        return f"gapfarm.Model({self.path!r})"

    def _file(self) -> str:
        return os.path.join(self.path, "model.toml") if os.path.isdir(self.path) else self.path

    @property
    def data(self) -> dict[str, Any]:
        """Everything in the file, by sections (docs/configuration.md)."""
        with open(self._file(), "rb") as file:
            return _toml.load(file)

    @property
    def parameters(self) -> dict[str, Any]:
        """Value of every base parameter, the noise's too; choices are words, SI units."""
        data = self.data
        rows = {**data.get("parameters", {}), **data.get("noise", {})}
        return {key: row.get("value") if isinstance(row, dict) else row for key, row in rows.items()}

    def predict(
        self, trials: Union[pd.DataFrame, Path, Sequence[Path]], workers: Optional[int] = None
    ) -> pd.DataFrame:
        """Where every trial should have ended, a row a trial, in the log's order.

        session, trial, x, y (m), theta (rad), the covariance cov_xx ... cov_tt of these (m^2, m rad,
        rad^2), log_score (nats) of what was measured.  `trials`: a table as of read_trials(), or trial
        logs.  `workers`: processes, else one a core.
        """
        with tempfile.TemporaryDirectory(prefix="gapfarm-") as folder:
            files: list[str]
            if isinstance(trials, pd.DataFrame):
                files = [os.path.join(folder, "trials.csv")]
                write_trials(trials, files[0])
            elif isinstance(trials, (str, os.PathLike)):
                files = [os.fspath(trials)]
            else:
                files = [os.fspath(file) for file in trials]
            out = os.path.join(folder, "predictions.csv")
            words = ["predict", self.path, "--trials", *files, "--out", out]
            command(words + ([] if workers is None else ["--workers", str(workers)]))
            table = read_table(out)
        table.attrs["units"] = dict(_UNITS)
        return table

    @staticmethod
    def covariances(predictions: pd.DataFrame) -> npt.NDArray[np.float64]:
        """Of predict(): float64 of shape (trials, 3, 3), axes x, y, theta."""
        upper = predictions[["cov_xx", "cov_xy", "cov_xt", "cov_yy", "cov_yt", "cov_tt"]].to_numpy()
        full = np.empty((len(upper), 3, 3))
        for column, (i, k) in enumerate([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]):
            full[:, i, k] = full[:, k, i] = upper[:, column]
        return full

    def simulate(self, *options: str, seed: Optional[int] = None) -> pd.DataFrame:
        """A trial log made by the model, a row a trial as read_trials() gives it, m, s and rad.

        `options` are words of `gapfarm simulate` ("--sessions", "2", "--set", "friction=0.4").
        """
        return self._simulated(options, seed)[0]

    def simulate_paths(
        self, *options: str, interval: float = 0.05, seed: Optional[int] = None
    ) -> tuple[pd.DataFrame, pd.DataFrame]:
        """(trials, paths): simulate()'s log, and a row a sample of every `interval` s of its ways as
        read_paths() gives them, m and rad in the world."""
        return self._simulated((*options, "--paths", repr(float(interval))), seed)

    def _simulated(
        self, options: Sequence[str], seed: Optional[int]
    ) -> tuple[pd.DataFrame, pd.DataFrame]:
        with tempfile.TemporaryDirectory(prefix="gapfarm-") as folder:
            out = os.path.join(folder, "trials.csv")
            words = ["simulate", self._file(), "--out", out, *options]
            command(words + ([] if seed is None else ["--seed", str(seed)]))
            paths = os.path.join(folder, "paths.csv")
            return read_trials(out), read_paths(paths) if os.path.exists(paths) else pd.DataFrame()
