#!/usr/bin/env python3
"""forward_front.py LOG_FOLDER OUT [SVG]: the front of position against heading on the real forward log.

Evolves configs/srv1_forward_front.toml into the folder OUT, and OUT.offset with one gene more (or reads the
runs that are there), and prints the front, its hypervolume by generation, and what weighted sums of the two objectives would have found of it: a
member that is best for no weights lies off the front's convex hull.  GAPFARM: the program."""

import glob
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GAPFARM = os.environ.get("GAPFARM", str(ROOT / "build/release/bin/gapfarm"))
WEIGHTS = [k / 1000 for k in range(1001)]  # of position; the rest is heading's


def run(log, out, more=""):
    """The status of a run of the config with `more` genes, which is evolved unless it is there."""
    if not os.path.exists(os.path.join(out, "run.sqlite")):
        trials = sorted(glob.glob(os.path.join(log, "*.dat")))
        text = (ROOT / "configs/srv1_forward_front.toml").read_text()
        os.makedirs(os.path.dirname(os.path.abspath(out)), exist_ok=True)
        config = Path(f"{out}.toml")
        config.write_text(text.replace("[genes]\n", "[genes]\n" + more))
        subprocess.run([GAPFARM, "evolve", str(config), "--trials", *trials, "--out", out], check=True)
    return json.loads(subprocess.check_output([GAPFARM, "status", out, "--json"]))


def width(front):
    return " by ".join(f"{abs(o['ideal'] - o['nadir']):.3f}" for o in front["objectives"])


def pair(member):
    return member["objectives"]["position"], member["objectives"]["heading"]


def by_weights(members):
    """The members that are best for some weights, each with the least and greatest weight of position."""
    found = {}
    for w in WEIGHTS:
        best = max(members, key=lambda m: w * pair(m)[0] + (1 - w) * pair(m)[1])
        found.setdefault(best["birth_id"], []).append(w)
    return {birth: (min(ws), max(ws)) for birth, ws in found.items()}


def row(name, member, weights):
    values = member["values"]
    shown_weights = " to ".join(f"{w:.3f}" for w in weights) if weights else "none"
    shown = ("motor_asymmetry.ratio", "drive_noise_side", "pose_noise_position", "pose_noise_heading")
    return (f"| {name} | {pair(member)[0]:.3f} | {pair(member)[1]:.3f} | {member['fitness']:.3f} | {shown_weights} | "
            + " | ".join(f"{values[key]:.4f}" for key in shown) + " |")


def picture(members, knee, weighted, size=(560, 380)):
    xs, ys = zip(*map(pair, members))
    spans = [(min(v), max(v)) for v in (xs, ys)]
    left, bottom, wide, high = 70, size[1] - 50, size[0] - 95, size[1] - 75
    def at(m):
        shares = [(v - lo) / ((hi - lo) or 1) for v, (lo, hi) in zip(pair(m), spans)]
        return left + shares[0] * wide, bottom - shares[1] * high
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]} {size[1]}" font-family="sans-serif" font-size="12">',
             f'<rect width="{size[0]}" height="{size[1]}" fill="#fff"/>',
             f'<path d="M{left} {bottom - high}V{bottom}h{wide}" fill="none" stroke="#5a6068"/>']
    for m in members:
        x, y = at(m)
        style = 'fill="#0060a8"' if m["birth_id"] in weighted else 'fill="#fff" stroke="#0060a8"'
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" {style}/>')
    x, y = at(knee)
    parts.append(f'<path d="M{x:.1f} {y - 9:.1f}l9 9l-9 9l-9 -9Z" fill="none" stroke="#b8500a" stroke-width="2"/>'
                 f'<text x="{x - 14:.1f}" y="{y + 18:.1f}" text-anchor="end" fill="#b8500a">knee</text>')
    for k, (name, (lo, hi)) in enumerate(zip(("position", "heading"), spans)):
        where = (f'x="{left + wide / 2}" y="{bottom + 36}"' if k == 0
                 else f'x="16" y="{bottom - high / 2}" transform="rotate(-90 16 {bottom - high / 2})"')
        parts.append(f'<text {where} text-anchor="middle">log density of {name}, nats a trial</text>')
        ends = (((left, bottom + 18, "start"), (left + wide, bottom + 18, "end")) if k == 0
                else ((left - 6, bottom, "end"), (left - 6, bottom - high + 10, "end")))
        for (tx, ty, anchor), value in zip(ends, (lo, hi)):
            parts.append(f'<text x="{tx}" y="{ty}" text-anchor="{anchor}" fill="#5a6068">{value:.2f}</text>')
    parts.append(f'<text x="{left + 20}" y="{bottom - high / 2}">filled: best for some weights; hollow: for none</text></svg>')
    return "\n".join(parts) + "\n"


def main():
    log, out = sys.argv[1:3]
    status = run(log, out)
    front = status["front"]
    members = sorted(front["members"], key=pair)
    weighted = by_weights(members)
    knee = next(m for m in members if m["birth_id"] == front["knee"])
    joint = max(members, key=lambda m: m["fitness"])
    equal = max(members, key=lambda m: sum(pair(m)))
    print(f"{status['evaluations']} evaluations, {len(members)} members of the front, {len(weighted)} of them best for "
          "some weights\n")
    print("| | position, nats | heading, nats | both together, nats | weights of position | motor asymmetry | "
          "drive noise of a side | position noise, m | heading noise, rad |\n|---|---|---|---|---|---|---|---|---|")
    rows = [("best heading", members[0]), ("knee", knee), ("best with equal weights", equal),
            ("best of both together", joint), ("best position", members[-1])]
    for name, member in rows:
        print(row(name, member, weighted.get(member["birth_id"])))
    volumes = front["hypervolume"]
    reference = ", ".join(f"{o['name']} {o['reference']:.2f}" for o in front["objectives"])
    shown = [g for g in (1, 2, 5, 10, 20, 30, 40, 60) if g <= len(volumes)]
    print(f"\nhypervolume from {reference}:\n\n| generation | " + " | ".join(map(str, shown)) + " |\n|---"
          + "|---" * len(shown) + "|\n| hypervolume | " + " | ".join(f"{volumes[g - 1]:.3f}" for g in shown) + " |")
    with_offset = run(log, f"{out}.offset", "heading_offset.angle = [-0.1, 0.1]\n")["front"]
    print(f"\nwidth of the front, nats: {width(front)}; with heading_offset among the genes {width(with_offset)}")
    if len(sys.argv) > 3:
        Path(sys.argv[3]).write_text(picture(members, knee, weighted))


if __name__ == "__main__":
    main()
