#!/usr/bin/env python3
"""What a correction without a cause closes, against what the truth closes, on logs that nobody saw.

    gapfarm blind-check configs/srv1.toml --out run/a --sizes clear --left-out 20 --nulls 60 --seed 31
    scripts/left_out_residuals.py run/a

Reads a finished blind check.  For each case whose effect was excluded from the catalogue the check has
simulated a second log of the same robot and effect (other drives, other noise) and had three models
predict it: the tuned base, the diagnosis's model.toml with its [residual], and the truth itself.  Gains
over the tuned base are printed, in nats a trial.  Where the truth gains less than 0.02 there is nothing to
close.  Of nulls nothing is to be kept."""

import argparse
import json
import pathlib
import sys

LEAST_GAP = 0.02


def diagnosis_of(folder, case):
    file = folder / "diagnoses" / case / "diagnosis.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}


def kept(diagnosis):
    return bool((diagnosis.get("residual") or {}).get("kept"))


def left_out_row(folder, case):
    """Whether [residual] closes half, and model.toml as it is; prints both."""
    fresh, truth = case["fresh_scores"], case["truth"]
    diagnosis = diagnosis_of(folder, case["case"])
    to_close = fresh["truth"] - fresh["tuned"]
    catalogue = fresh["final"] - fresh["tuned"]
    whole = fresh.get("corrected", fresh["final"]) - fresh["tuned"]
    by_model = whole >= to_close / 2
    by_residual = by_model and kept(diagnosis)
    text = "nothing to close" if to_close < LEAST_GAP else "yes" if by_residual else "no"
    print(f"| {case['case']} | {truth['left_out']} | {diagnosis.get('verdict', '-')} | {to_close:.3f} | "
          f"{catalogue:.3f} | {f'{whole:.3f}' if kept(diagnosis) else '-'} | {text} |")
    return to_close >= LEAST_GAP, by_residual, by_model


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="of a finished blind check")
    folder = parser.parse_args().folder
    result = folder / "blind_check.json"
    if not result.exists():
        sys.exit(f"{result} is not there: is this the folder of a finished blind check?")
    cases = json.loads(result.read_text(encoding="utf-8"))["cases"]
    left_out = [c for c in cases if (c.get("truth") or {}).get("left_out")]
    unscored = [c["case"] for c in left_out if "fresh_scores" not in c]
    if unscored:
        sys.exit(f"{result} has no fresh_scores of {', '.join(unscored)}: it was judged by an earlier version, "
                 "or a simulation failed. Remove blind_check.json and run blind-check again: it only judges")
    print("| case | excluded | verdict | truth closes | catalogue's correction | with [residual] | at least half |\n"
          "|---|---|---|---|---|---|---|")
    rows = [left_out_row(folder, case) for case in left_out]
    empty = sum(not some for some, _, _ in rows)
    print(f"\n[residual] closes at least half of what the truth does: {sum(r for some, r, _ in rows if some)} of "
          f"{len(rows) - empty}, and {empty} with nothing to close; model.toml, with [residual] or without: "
          f"{sum(m for some, _, m in rows if some)} of {len(rows) - empty}")
    nulls = [c["case"] for c in cases if (c.get("truth") or {}).get("kind") == "null"]
    print(f"nothing kept of nulls: {sum(not kept(diagnosis_of(folder, n)) for n in nulls)} of {len(nulls)}")


if __name__ == "__main__":
    main()
