#!/usr/bin/env python3
"""Prints what diagnoses cost: CPU seconds of master and workers, and where the time went.

    scripts/diagnosis_times.py --out run/times [--config configs/srv1.toml]
                               [--gapfarm build/release/bin/gapfarm] LOG...

LOG is a trials.csv; each is diagnosed afresh, one after the other, with two workers, in a folder of
OUT that is named after the log's folder.  A LOG may be followed by :NAME,... of effects that its
diagnosis leaves out.  CPU seconds do not depend on what else the machine does, those of the stages
do.  Standard library only.
"""
import argparse
import json
import os
import resource
import shutil
import statistics
import subprocess


def cpu_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def diagnose(args, log, left_out):
    folder = os.path.join(args.out, os.path.basename(os.path.dirname(os.path.abspath(log))))
    shutil.rmtree(folder, ignore_errors=True)
    command = [args.gapfarm, "diagnose", args.config, "--trials", log, "--out", folder,
               "--workers", "2"]
    if left_out:
        command += ["--leave-out", *left_out.split(",")]
    before = cpu_s()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(os.path.join(folder, "diagnosis.json"), encoding="utf-8") as file:
        return folder, cpu_s() - before, json.load(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True)
    parser.add_argument("--config", default="configs/srv1.toml")
    parser.add_argument("--gapfarm", default="build/release/bin/gapfarm")
    parser.add_argument("logs", nargs="+", metavar="LOG")
    args = parser.parse_args()
    stages = ["tune", "measure", "screen", "refit"]
    print("| log | said | CPU s | " + " | ".join(f"{s}, s" for s in stages) + " |")
    print("|" + "---|" * (3 + len(stages)))
    spent = []
    for entry in args.logs:
        log, _, left_out = entry.partition(":")
        folder, cpu, said = diagnose(args, log, left_out)
        spent.append(cpu)
        took = {row["stage"].split()[0]: row["seconds"] for row in said["timing"]}
        what = said["verdict"]
        if said["effects"]:
            what += ": " + ", ".join(effect["name"] for effect in said["effects"])
        print(f"| {os.path.basename(folder)} | {what} | {cpu:.1f} | " +
              " | ".join(f"{took.get(s, 0):.1f}" for s in stages) + " |", flush=True)
    print(f"\n{len(spent)} logs: median {statistics.median(spent):.1f} CPU s, "
          f"most {max(spent):.1f}")


if __name__ == "__main__":
    main()
