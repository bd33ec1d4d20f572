"""gapfarm's runs, models, diagnoses and logs in Python.

Runs are read from their store (SQLite, read only, also while they go on); what needs a simulation is
asked of the program ``gapfarm``, which has to be installed (``GAPFARM`` names another one).  Units are
m, s and rad; a table's ``attrs["units"]`` says the unit of each column that has one.
"""

import importlib
from typing import TYPE_CHECKING, Any

from . import objective as objective

if TYPE_CHECKING:
    from ._diagnosis import Diagnosis, diagnose
    from ._logs import read_paths, read_trials, read_windows, write_trials, write_windows
    from ._model import Model
    from ._program import GapfarmError, command, version
    from ._run import Run, evolve

__all__ = [
    "Diagnosis",
    "GapfarmError",
    "Model",
    "Run",
    "command",
    "diagnose",
    "evolve",
    "read_paths",
    "read_trials",
    "read_windows",
    "version",
    "write_trials",
    "write_windows",
]

_HOMES = {
    "_diagnosis": ("Diagnosis", "diagnose"),
    "_logs": ("read_paths", "read_trials", "read_windows", "write_trials", "write_windows"),
    "_model": ("Model",),
    "_program": ("GapfarmError", "command", "version"),
    "_run": ("Run", "evolve"),
}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """The rest is loaded when it is used: a program that serves an objective needs no pandas."""
        for home, names in _HOMES.items():
            if name in names:
                return getattr(importlib.import_module("." + home, __name__), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
