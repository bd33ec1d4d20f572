#!/usr/bin/env python3
"""How often effects of stated sizes are named, beside how often the certificate says they would be.

    gapfarm blind-check configs/srv1.toml --out CHECK --effects battery_sag camera_aspect ... \\
        --sizes 1.006 1.015 1.03 1.06 --per-effect 5 --nulls 8 --pairs 0 --left-out 0
    scripts/power_curves.py CHECK

What is predicted of a case is what its own log says: the size from which on it names the effect
(`detectable_from`, 95 %; where its log says nothing, the median of the check's nulls). An effect of
another size is named where twice its gain, a noncentral chi-squared, passes what 95 % of effects of
that size pass. Effects of one strength.
"""
import json
import math
import pathlib
import statistics
import sys

from foreign_tables import wilson

POWER = 0.95
LEAST_GAIN = 9.0  # nats that a name asks for (docs/diagnosis.md), one parameter
STUDENT = 0.849  # of twice a gain, what Student's weights leave on Gaussian noise (infer/certificate.cc)


def normal_above(z):
    """Chance of a standard normal beyond z."""
    return math.erfc(z / math.sqrt(2)) / 2


def chance(size):
    """Of being named, of an effect `size` times as large as one that is with POWER: one parameter,
    whose estimate over its deviation is normal about its size and has to pass a threshold."""
    threshold = math.sqrt(2 * (LEAST_GAIN + 1) * STUDENT)
    z = -next(k / 1000 for k in range(-5000, 0) if normal_above(k / 1000) < POWER)
    at = (threshold + z) * size
    return normal_above(threshold - at) + normal_above(threshold + at)


def diagnosis(folder, case):
    """What was said of a case."""
    return json.loads((folder / "diagnoses" / case / "diagnosis.json").read_text(encoding="utf-8"))


def detectable(folder, case):
    """By effect and strength."""
    return {(row["effect"], key): size for row in diagnosis(folder, case["case"])["screening"]
            for key, size in row.get("detectable_from", {}).items()}


def detectable_of_nulls(folder, cases):
    """The same, the median of the nulls."""
    sizes = {}
    for case in cases:
        for at, size in detectable(folder, case).items() if case["truth"]["kind"] == "null" else ():
            sizes.setdefault(at, []).append(size)
    return {at: statistics.median(of) for at, of in sizes.items()}


def main():
    """Prints the table."""
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    cases = json.loads((folder / "blind_check.json").read_text(encoding="utf-8"))["cases"]
    known, rows = detectable_of_nulls(folder, cases), {}
    for case in cases:
        truth = case["truth"]
        if truth["kind"] != "single":
            continue
        (effect, values), = truth["effects"].items()
        strengths = [(key, value) for key, value in values.items() if (effect, key) in known]
        if len(strengths) != 1:
            continue
        key, value = strengths[0]
        neutral = 1 if effect == "camera_aspect" else 0
        own = detectable(folder, case).get((effect, key), known[effect, key])
        expected = chance(abs(value - neutral) / own)
        said = case["said"] or {"effects": []}
        named = any(effect in [one["name"], *one["aliases"]] for one in said["effects"])
        for at in ((effect, truth["level"]), (effect, "all"), ("all", "all")):
            rows.setdefault(at, []).append((expected, named))
    print("| effect | size | cases | named [95 %] | predicted |\n|---|---|---|---|---|")
    for (effect, level), of in sorted(rows.items()):
        print(f"| {effect} | {level} | {len(of)} | {wilson(sum(named for _, named in of), len(of))} "
              f"| {100 * statistics.mean(expected for expected, _ in of):.0f} % |")


if __name__ == "__main__":
    main()
