"""A Python function as the program of scenario ``objective`` (docs/objective.md).  Needs nothing but Python."""

from __future__ import annotations

import json
import math
import os
import sys
import traceback
from typing import Any, Callable, Mapping, Sequence

Function = Callable[[Mapping[str, Any], int], Any]


def answer(function: Function, parameters: Mapping[str, Any], seed: int) -> "dict[str, Any]":
    """What the protocol answers for ``function(parameters, seed)``, without the id.

    The function returns a number, or a mapping with ``value`` (or ``values``, a mapping of several
    names to numbers), and perhaps ``violations`` (a list, above 0: violated) and ``notes`` (a text).  What it raises, and a value that is not finite,
    is a failed evaluation with its message; the traceback goes to stderr.
    """
    try:
        given = function(parameters, seed)
        reply: "dict[str, Any]" = dict(given) if isinstance(given, Mapping) else {"value": given}
        if reply.get("value") is not None:
            reply["value"] = float(reply["value"])
        if "values" in reply:
            reply["values"] = {
                str(name): None if value is None else float(value)
                for name, value in reply["values"].items()
            }
        reply["violations"] = [float(violation) for violation in reply.get("violations", [])]
        json.dumps(reply)  # notes, or what the protocol does not know, may be no JSON
    except Exception as error:  # noqa: BLE001 - whatever a user's function raises
        traceback.print_exc()
        return {"outcome": "failed", "message": f"{type(error).__name__}: {error}"}
    several = reply.get("values", {})
    for name, numbers in (
        ("value", [reply.get("value")]),
        ("violation", reply["violations"]),
        *((name, [value]) for name, value in several.items()),
    ):
        bad = [n for n in numbers if n is not None and not math.isfinite(n)]
        if bad:
            return {"outcome": "failed", "message": f"its {name} is {bad[0]}"}
    return reply


def serve(function: Function, parameters: Sequence[Mapping[str, Any]], name: str = "") -> None:
    """Answers gapfarm's questions with ``function`` until there are no more.

    ``parameters`` is declared as it is: a mapping each with ``key``, ``lower``, ``upper``, ``nominal``, or ``choices``.
    What the function prints goes to stderr, also from libraries below Python.
    """
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        asked = json.loads(line)
        if "id" in asked:
            reply = {"id": asked["id"], **answer(function, asked["parameters"], asked["seed"])}
        else:
            called = name or getattr(function, "__name__", "objective")
            reply = {"gapfarm": 1, "name": called, "parameters": list(parameters)}
        # Bounds may be numpy's.
        print(json.dumps(reply, default=lambda number: number.item()), file=answers, flush=True)
