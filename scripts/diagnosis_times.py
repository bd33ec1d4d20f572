#!/usr/bin/env python3
"""Prints what diagnoses cost: CPU seconds of master and workers, and where the time went.

    scripts/diagnosis_times.py --out run/times [--config configs/srv1.toml]
                               [--gapfarm build/release/bin/gapfarm] LOG...
    scripts/diagnosis_times.py --check run/a [--again run/b [--jobs 2]]

LOG is a trials.csv; each is diagnosed again, one after the other, with two workers, in a folder of
OUT that is named after the log's folder.  A LOG may be followed by :NAME,... of effects that its
diagnosis excludes.  CPU seconds do not depend on what else the machine does, those of the stages
do.  With --check nothing is diagnosed: what the cases of a finished blind check cost is printed by kind, the
CPU seconds of a case shared among its stages as its wall seconds are.  With --again, by this
build: its cases are diagnosed once more in a folder of their own, one worker each, and how many are
called and named as in the check is printed with what they cost; given again, it goes on.  Standard
library only.
"""
import argparse
import concurrent.futures
import json
import os
import shutil
import statistics
import subprocess


def cpu_s_of(command):
    """Of a command that ends well, and of all that it starts."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: ended with {process.returncode}")
    return used.ru_utime + used.ru_stime


def diagnose(args, log, left_out):
    folder = os.path.join(args.out, os.path.basename(os.path.dirname(os.path.abspath(log))))
    shutil.rmtree(folder, ignore_errors=True)
    command = [args.gapfarm, "diagnose", args.config, "--trials", log, "--out", folder,
               "--workers", "2"]
    if left_out:
        command += ["--exclude", *left_out.split(",")]
    cpu = cpu_s_of(command)
    return folder, cpu, read(args.out, os.path.basename(folder))


STAGES = ["tune", "measure", "screen", "refit"]


def by_stage(diagnosis):
    return {row["stage"].split()[0]: row["seconds"] for row in diagnosis["timing"]}


def named(diagnosis):
    return diagnosis["verdict"], [effect["name"] for effect in diagnosis["effects"]]


def read(folder, case):
    with open(os.path.join(folder, case, "diagnosis.json"), encoding="utf-8") as file:
        return json.load(file)


def diagnose_again(args, case):
    """CPU seconds of a check's case, with the options that it had there."""
    before = os.path.join(args.check, "diagnoses", case)
    out = os.path.join(args.again, case)
    cost = os.path.join(args.again, case + ".cpu_s")
    if os.path.exists(cost):
        with open(cost, encoding="utf-8") as file:
            return float(file.read())
    with open(os.path.join(before, "question.json"), encoding="utf-8") as file:
        options = json.load(file)["options"]
    command = [args.gapfarm, "diagnose", args.config, "--trials",
               os.path.join(args.check, "cases", case, "trials.csv"), "--out", out,
               "--workers", "1", "--seed", str(options["seed"])]
    if options.get("leave-out"):
        command += ["--exclude", *options["leave-out"]]
    shutil.rmtree(out, ignore_errors=True)
    spent = cpu_s_of(command)
    with open(cost, "w", encoding="utf-8") as file:
        file.write(f"{spent}\n")
    return spent


def tell_check(args):
    """A table of kinds of case: CPU seconds in all, and the means of stages."""
    with open(os.path.join(args.check, "blind_check.json"), encoding="utf-8") as file:
        cases = [c for c in json.load(file)["cases"] if c.get("truth") and c["outcome"] == "done"]
    diagnoses = os.path.join(args.check, "diagnoses")
    if args.again:
        os.makedirs(args.again, exist_ok=True)
        with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
            spent = list(pool.map(lambda c: diagnose_again(args, c["case"]), cases))
        as_before = 0
        for case, cpu in zip(cases, spent):
            case["cpu_s"] = cpu
            as_before += named(read(args.again, case["case"])) == named(read(diagnoses, case["case"]))
        print(f"{as_before} of {len(cases)} called and named as before\n")
        diagnoses = args.again
    tell_kinds(cases, diagnoses)


def tell_kinds(cases, diagnoses):
    kinds = {"null": "nulls", "single": "single effects", "pair": "pairs",
             "outside": "left-out effects"}
    print("| kind | cases | CPU s: median | most | above 60 | " + " | ".join(STAGES) + " | rest |")
    print("|" + "---|" * (6 + len(STAGES)))
    for kind, label in kinds.items():
        spent, stages = [], []
        for case in cases:
            if case["truth"]["kind"] != kind:
                continue
            took = by_stage(read(diagnoses, case["case"]))
            whole = sum(took.values())
            spent.append(case["cpu_s"])
            stages.append([case["cpu_s"] * took.get(s, 0) / whole for s in STAGES])
        if not spent:
            continue
        means = [statistics.mean(row[k] for row in stages) for k in range(len(STAGES))]
        means.append(statistics.mean(spent) - sum(means))
        print(f"| {label} | {len(spent)} | {statistics.median(spent):.1f} | {max(spent):.1f} | "
              f"{sum(s > 60 for s in spent)} | " + " | ".join(f"{m:.1f}" for m in means) + " |")
    all_spent = [case["cpu_s"] for case in cases]
    slowest = sorted(cases, key=lambda case: -case["cpu_s"])[:5]
    print(f"\n{len(all_spent)} cases: median {statistics.median(all_spent):.1f} CPU s; slowest: " + ", ".join(
        f"{c['case']} ({c['truth'].get('left_out') or ' and '.join(c['truth']['effects']) or 'null'}"
        f"{' excluded' if c['truth'].get('left_out') else ''}) {c['cpu_s']:.0f}" for c in slowest))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", help="where diagnoses go")
    parser.add_argument("--check", metavar="FOLDER", help="of a finished blind check")
    parser.add_argument("--again", metavar="FOLDER", help="diagnose the check's cases there")
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at a time, of --again")
    parser.add_argument("--config", default="configs/srv1.toml")
    parser.add_argument("--gapfarm", default="build/release/bin/gapfarm")
    parser.add_argument("logs", nargs="*", metavar="LOG")
    args = parser.parse_args()
    if args.check:
        tell_check(args)
        return
    if not args.out or not args.logs:
        parser.error("give --out and logs, or --check FOLDER")
    print("| log | said | CPU s | " + " | ".join(f"{s}, s" for s in STAGES) + " |")
    print("|" + "---|" * (3 + len(STAGES)))
    spent = []
    for entry in args.logs:
        log, _, left_out = entry.partition(":")
        folder, cpu, said = diagnose(args, log, left_out)
        spent.append(cpu)
        took = by_stage(said)
        what = said["verdict"]
        if said["effects"]:
            what += ": " + ", ".join(effect["name"] for effect in said["effects"])
        print(f"| {os.path.basename(folder)} | {what} | {cpu:.1f} | " +
              " | ".join(f"{took.get(s, 0):.1f}" for s in STAGES) + " |", flush=True)
    print(f"\n{len(spent)} logs: median {statistics.median(spent):.1f} CPU s, "
          f"most {max(spent):.1f}")


if __name__ == "__main__":
    main()
