"""gapfarm's runs, models, diagnoses and logs in Python.

Runs are read from their store (SQLite, read only, also while they go on); what needs a simulation is
asked of the program ``gapfarm``, which has to be installed (``GAPFARM`` names another one).  Units are
m, s and rad; a table's ``attrs["units"]`` says the unit of each column that has one.
"""

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
