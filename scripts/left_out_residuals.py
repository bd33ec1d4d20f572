#!/usr/bin/env python3
"""What a correction without a cause closes, against what the true effect would.

    gapfarm blind-check configs/srv1.toml --out run/a --sizes clear --left-out 20 --nulls 40 --seed 31
    scripts/left_out_residuals.py run/a --out run/residuals

Takes a finished blind check's cases whose effect was left out of the catalogue and diagnoses each twice:
without that effect, where [residual] may help, and with the whole catalogue, where the effect itself may
be added.  Both are scored on trials that their fits did not see, in nats a trial.  Nulls are diagnosed
once; nothing is to be kept of them.  With --quick the second diagnosis is spared: the whole gap stands for
what the true effect closes, which is no more.  GAPFARM names the program (default: build/release/bin/gapfarm).  A
run that was stopped goes on where it was."""

import argparse
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="of a finished blind check")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="where diagnoses go")
    parser.add_argument("--config", default=str(ROOT / "configs/srv1.toml"))
    parser.add_argument("--nulls", type=int, default=40, help="at most so many (default: 40)")
    parser.add_argument("--cases", nargs="*", help="these alone, case009 case022 ...")
    parser.add_argument("--quick", action="store_true", help="against the whole gap")
    parser.add_argument("--workers", default="2")
    return parser.parse_args()


def diagnosed(args, case, name, leave_out):
    """diagnosis.json of a case, made unless it is there."""
    out = args.out / f"{case}-{name}"
    file = out / "diagnosis.json"
    if not file.exists():
        program = os.environ.get("GAPFARM", str(ROOT / "build/release/bin/gapfarm"))
        command = [program, "diagnose", args.config, "--workers", args.workers, "--out", str(out),
                   "--trials", str(args.folder / "cases" / case / "trials.csv")]
        if leave_out:
            command += ["--leave-out", *leave_out]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return json.loads(file.read_text(encoding="utf-8"))


def left_out_row(args, case, effect):
    """Nats that the truth closes, that [residual] does, that model.toml does."""
    asked = args.folder / "diagnoses" / case / "question.json"  # with what always passes for it
    options = json.loads(asked.read_text(encoding="utf-8"))["options"]
    without = diagnosed(args, case, "left_out", options["leave-out"])
    if args.quick:
        truth = without["gap"]["tuned"]
    else:
        whole = diagnosed(args, case, "whole", [])
        truth = whole["gap"]["tuned"] - whole["gap"]["final"]
    residual = without.get("residual") or {"kept": False}
    gained = residual["gained"] if residual["kept"] else 0.0
    after = residual["gap_after"] if residual["kept"] else without["gap"]["final"]
    model = without["gap"]["tuned"] - after
    half = gained >= truth / 2
    print(f"| {case} | {effect} | {without['verdict']} | {truth:.3f} | {gained:.3f} | {model:.3f} | "
          f"{'yes' if half else 'no'} |", flush=True)
    return half


def main():
    args = arguments()
    args.out.mkdir(parents=True, exist_ok=True)
    truths = sorted((args.folder / "truth").glob("*.json"))
    if not truths:
        sys.exit(f"{args.folder}/truth holds no *.json: is this the folder of a finished blind check?")
    left_out, nulls = [], []
    for path in truths:
        truth = json.loads(path.read_text(encoding="utf-8"))
        case = path.stem
        if args.cases and case not in args.cases:
            continue
        if truth["left_out"]:
            left_out.append((case, truth["left_out"]))
        elif truth["kind"] == "null":
            nulls.append(case)
    against = "gap" if args.quick else "true effect closes"
    print(f"| case | left out | verdict | {against} | [residual] closes | model.toml closes | "
          "at least half |\n|---|---|---|---|---|---|---|")
    halves = [left_out_row(args, case, effect) for case, effect in left_out]
    print(f"\n[residual] closes at least half of what the true effect closes: {sum(halves)} of {len(halves)}")
    kept = 0
    for case in nulls[:args.nulls]:
        found = diagnosed(args, case, "null", [])
        kept += bool((found.get("residual") or {}).get("kept"))
    tried = len(nulls[:args.nulls])
    print(f"nothing kept of nulls: {tried - kept} of {tried}")


if __name__ == "__main__":
    main()
