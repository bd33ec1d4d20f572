"""Diagnoses: what is missing from the simulation."""

from __future__ import annotations

import json
import os
from typing import Any, Optional, Sequence, Union

import pandas as pd

from ._logs import Path
from ._model import Model
from ._program import Progress, command, files


class Diagnosis:
    """The folder of a diagnosis, or its diagnosis.json.  Read once; pickles."""

    def __init__(self, path: Path):
        self.path = os.fspath(path)
        file = os.path.join(self.path, "diagnosis.json") if os.path.isdir(self.path) else self.path
        with open(file, encoding="utf-8") as opened:
            #: Everything in diagnosis.json (docs/formats.md).
            self.data: dict[str, Any] = json.load(opened)

    def __repr__(self) -> str:
        return f"gapfarm.Diagnosis({self.path!r}): {self.headline}"

    @property
    def verdict(self) -> str:
        """In one word: "effect", "none", "unknown", "effect+unknown" or "unusable"."""
        return str(self.data["verdict"])

    @property
    def headline(self) -> str:
        """In one sentence."""
        return str(self.data["headline"])

    @property
    def effects(self) -> pd.DataFrame:
        """A row a parameter of each named effect: effect, parameter, value with its 90 % interval lo
        and hi, unit, confidence, gap_before and gap_after (nats a trial), aliases."""
        columns = ["effect", "parameter", "value", "lo", "hi", "unit"]
        columns += ["confidence", "gap_before", "gap_after", "aliases"]
        rows = []
        for effect in self.data["effects"]:
            rest = {k: effect[k] for k in ("confidence", "gap_before", "gap_after", "aliases")}
            for parameter, value in effect["parameters"].items():
                rows.append({"effect": effect["name"], "parameter": parameter, **value, **rest})
        return pd.DataFrame(rows, columns=columns)

    @property
    def where(self) -> pd.DataFrame:
        """Where the gap lies, a row a finding: command, component, kind, covariate, size (unit: mm, or mrad),
        share of the gap, p, text."""
        return pd.DataFrame(self.data["where"])

    @property
    def model(self) -> Model:
        """The tuned model with the effects that were named.  A ground robot's diagnosis has none:
        what it corrects is robot.toml, beside it."""
        folder = self.path if os.path.isdir(self.path) else os.path.dirname(self.path)
        if not os.path.exists(os.path.join(folder, "model.toml")):
            raise FileNotFoundError(
                f"{folder} has no model.toml: of an unusable log there is none, and of a ground "
                "robot robot.toml is what was corrected"
            )
        return Model(folder)


def diagnose(
    config: Path,
    out: Path,
    *options: str,
    trials: Union[Path, Sequence[Path]] = (),
    progress: Optional[Progress] = None,
) -> Diagnosis:
    """`gapfarm diagnose CONFIG --out OUT` of the trial logs `trials`, else of the config's own.

    `options` are more of its words ("--workers", "4"); `progress` is called with every line that it
    says.  Raises GapfarmError; one of exit code 85 was stopped, and the same call goes on.
    """
    words: list[str] = ["diagnose", os.fspath(config), "--out", os.fspath(out), *options]
    command(words + files("--trials", trials), progress)
    return Diagnosis(out)
