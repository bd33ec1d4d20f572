#!/usr/bin/env python3
"""Adds up what `gapfarm blind-check` judged in the folders of scripts/foreign_check.sh.

scripts/foreign_tables.py OUT...
"""

import json
import math
import statistics
import sys
from pathlib import Path

KINDS = [
    ("single", "clear", "one clear effect: it or its alias named first"),
    ("single", "subtle", "one subtle effect: the same"),
    ("null", "", "nothing: called `none`"),
    ("outside", "clear", "clear, outside the catalogue: `unknown`"),
]


def wilson(hits, total, z=1.959964):
    """The score interval of a share, as blind-check has it, in per cent."""
    if total == 0:
        return "-"
    p, z2 = hits / total, z * z
    centre = (p + z2 / (2 * total)) / (1 + z2 / total)
    half = z / (1 + z2 / total) * math.sqrt(p * (1 - p) / total + z2 / (4 * total * total))
    lower = 0 if hits == 0 else centre - half
    upper = 1 if hits == total else centre + half
    return f"{100 * p:.0f} % [{100 * lower:.0f}, {100 * upper:.0f}]"


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |")


def head(*cells):
    print()
    row(*cells)
    row(*("---" for _ in cells))


def kind_of(truth):
    kind = {"none": "null", "unknown": "outside"}.get(truth["answer"], "single")
    return kind, truth["level"]


def named(values):
    return ", ".join(f"{key} {value:.3g}" for key, value in values.items())


def said(case):
    """What was said, as on a line."""
    if case["said"] is None:
        return case.get("outcome_text", "no diagnosis")
    effects = [e["name"] for e in case["said"]["effects"]]
    return " ".join([case["said"]["verdict"], *effects])


def rates(cases):
    head("what", "right", "[95 %]")
    for kind, level, words in KINDS:
        of_kind = [c for c in cases if kind_of(c["truth"]) == (kind, level)]
        if not of_kind:
            continue
        hits = sum(c["right"] for c in of_kind)
        row(words, f"{hits}/{len(of_kind)}", wilson(hits, len(of_kind)))
        if kind == "null":
            false = sum(bool(c["said"] and c["said"]["effects"]) for c in of_kind)
            row("nothing: an effect named", f"{false}/{len(of_kind)}", wilson(false, len(of_kind)))


def wrong(cases):
    if all(c["right"] for c in cases):
        return
    head("wrong", "truth", "reported")
    for c in cases:
        if not c["right"]:
            truth = "; ".join(f"{n} {named(v)}" for n, v in c["truth"]["effects"].items())
            level = " ".join(kind_of(c["truth"])).strip()
            row(f"{c['folder']}/{c['case']}, {level}", truth or "nothing", said(c))


def coverage(cases):
    parameters = [p for c in cases for p in c["coverage"]]
    if not parameters:
        return
    head("within their 90 % interval", "", "[95 %]")
    for words, strength in [("strengths", True), ("places, directions, ages", False)]:
        some = [p["covered"] for p in parameters if p["strength"] == strength]
        row(words, f"{sum(some)}/{len(some)}", wilson(sum(some), len(some)))
    row("all", f"{sum(p['covered'] for p in parameters)}/{len(parameters)}",
        wilson(sum(p["covered"] for p in parameters), len(parameters)))
    head("outside its interval", "truth", "interval")
    for c in cases:
        for p in c["coverage"]:
            if not p["covered"]:
                row(f"{c['folder']}/{c['case']} {p['parameter']}", f"{p['truth']:.4g}",
                    f"[{p['lo']:.4g}, {p['hi']:.4g}]" if p["lo"] is not None else "none given")


def seconds(cases):
    head("CPU seconds", "cases", "median", "most")
    kinds = {}
    for c in cases:
        kinds.setdefault(" ".join(kind_of(c["truth"])).strip(), []).append(c["cpu_s"])
    for kind, spent in [*sorted(kinds.items()), ("all", [c["cpu_s"] for c in cases])]:
        row(kind, len(spent), f"{statistics.median(spent):.1f}", f"{max(spent):.1f}")


def null_gains(cases):
    """The most that any candidate gained in each null, where its diagnosis screened any."""
    most = []
    for c in cases:
        if c["truth"]["answer"] == "none" and c["said"] is not None:
            diagnosis = json.loads((c["diagnosis"] / "diagnosis.json").read_text())
            gains = [s["gain"] for s in diagnosis["screening"] if s["gain"] is not None]
            if gains:
                most.append(max(gains))
    if not most:
        return
    most.sort()
    in_95 = most[min(len(most) - 1, math.ceil(0.95 * len(most)) - 1)]
    head("best candidate of a null, nats", "nulls", "median", "95 % below", "most")
    row("gain", len(most), f"{statistics.median(most):.1f}", f"{in_95:.1f}", f"{most[-1]:.1f}")


def main(folders):
    cases = []
    for folder in map(Path, folders):
        check = folder / "check"
        for case in json.loads((check / "blind_check.json").read_text())["cases"]:
            if "truth" in case:
                case["folder"] = folder.name
                case["diagnosis"] = check / "diagnoses" / case["case"]
                cases.append(case)
    for table in (rates, wrong, coverage, null_gains, seconds):
        table(cases)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
