#!/usr/bin/env python3
"""Turns logs of the DART car (Lorenzo-Lyons/DART) into a folder of runs.

    scripts/dart_runs.py OUT LOG.csv [LOG.csv ...] [--half first|second]

Throttle counts while the driver holds the button; what is before the first and after the last motion
is excluded; poses are thinned to 40 Hz.
"""
import argparse
import csv
import os

RATE_S = 0.025
MOVING_M_S = 0.1
SPAN_S = 0.2


def read(path):
    """Rows (t, x, y, theta, throttle, steering) on the tracker's clock, from 0."""
    rows = []
    with open(path, newline="", encoding="utf-8") as file:
        for r in csv.DictReader(file):
            t = float(r["vicon time"])
            throttle = float(r["throttle"]) if float(r["safety_value"]) > 0 else 0.0
            if rows and t <= rows[-1][0]:
                continue
            rows.append((t, float(r["vicon x"]), float(r["vicon y"]), float(r["vicon yaw"]),
                         throttle, float(r["steering"])))
    return [(r[0] - rows[0][0], *r[1:]) for r in rows]


def moving(rows):
    """From half a second before it first moves to half a second after it last does."""
    times, j = [], 0
    for a in rows:
        while j + 1 < len(rows) and rows[j][0] < a[0] + SPAN_S:
            j += 1
        b = rows[j]
        way = ((b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2) ** 0.5
        if b[0] > a[0] and way / (b[0] - a[0]) > MOVING_M_S:
            times.append(a[0])
    return [r for r in rows if times and times[0] - 0.5 <= r[0] <= times[-1] + 0.5]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("logs", nargs="+")
    parser.add_argument("--half", choices=["first", "second"])
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    commands, poses, began = ["run,t,throttle,steering"], ["run,t,x,y,theta"], 0.0
    for run, path in enumerate(args.logs, 1):
        rows = moving(read(path))
        if args.half:
            middle = (rows[0][0] + rows[-1][0]) / 2
            rows = [r for r in rows if (r[0] < middle) == (args.half == "first")]
        start, commanded, last = rows[0][0], None, -1.0
        for t, x, y, theta, throttle, steering in rows:
            at = began + t - start
            if commanded != (throttle, steering):
                commanded = (throttle, steering)
                commands.append(f"{run},{at:.4f},{throttle:.5f},{steering:.5f}")
            if t - last >= RATE_S - 1e-3:
                last = t
                poses.append(f"{run},{at:.4f},{x:.5f},{y:.5f},{theta:.5f}")
        began += rows[-1][0] - start + 10
    for name, lines in (("commands.csv", commands), ("poses.csv", poses)):
        with open(os.path.join(args.out, name), "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
