#!/usr/bin/env python3
"""effect_pictures.py [OUT]: the pictures of docs/effects.md, by simulated logs of the SRV-1's six commands.

Every command of one second is driven from (-0.1, -0.1) m in the world, ten minutes into a session, without
the effect and with it, six times where chance has a say, without noise.  Strengths stand three tenths of the
way from neutral to their upper bound.  OUT is docs/pictures/effects.  GAPFARM: the program."""

import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GAPFARM = os.environ.get("GAPFARM", str(ROOT / "build/release/bin/gapfarm"))
CONFIG = ROOT / "configs/srv1.toml"
DUTIES = {"forward": (1, 1), "backward": (-1, -1), "turn_ccw": (-0.3, 0.3), "turn_cw": (0.3, -0.3),
          "wide_ccw": (0.4, 1), "wide_cw": (1, 0.4)}
START = (-0.1, -0.1, 0)
DRAWS = 6  # of an effect of chance
LEAST_M = 0.04  # shown of the floor
NOISE = {"drive_noise_common": 0, "drive_noise_side": 0, "pose_noise_position": 1e-5, "pose_noise_heading": 1e-5}
GREY, BLACK, PALE = "#888888", "#111111", "#999999"


def plan(file, reversing):
    """A session a command and draw; where the last direction matters, behind a drive the other way."""
    with open(file, "w") as out:
        out.write("session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1\n")
        pose = ",".join(map(str, START + START))
        for command, (left, right) in DUTIES.items():
            for draw in range(DRAWS):
                for trial, sense in enumerate((-1, 1) if reversing else (1,)):
                    out.write(f"{command}_{draw},{trial},600,{command},{sense * left},{sense * right},1,{pose}\n")


def drives(folder, settings):
    """By command: ways, seen from the logged start."""
    pairs = [f"{key}={value}" for key, value in {**NOISE, **settings}.items()]
    subprocess.run([GAPFARM, "simulate", str(CONFIG), "--like", "plan.csv", "--out", "log.csv", "--paths", "0.1",
                    "--force", "--set", *pairs], check=True, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(folder / "log.csv") as log, open(folder / "paths.csv") as paths:
        trials = {(t["session"], t["trial"]): t for t in csv.DictReader(log)}
        ways = {key: [] for key in trials}
        for row in csv.DictReader(line for line in paths if not line.startswith("#")):
            ways[row["session"], row["trial"]].append(tuple(float(row[k]) for k in ("x", "y", "theta")))
    found = {command: [] for command in DUTIES}
    for (session, number), trial in trials.items():
        if (session, str(int(number) + 1)) in trials:
            continue
        x0, y0, turn = (float(trial[k]) for k in ("x0", "y0", "theta0"))
        c, s = math.cos(turn), math.sin(turn)
        end = tuple(float(trial[k]) for k in ("x1", "y1", "theta1"))
        found[session.rsplit("_", 1)[0]].append(
            [(c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0), theta - turn)
             for x, y, theta in [*ways[session, number], end]])
    return found


def alike(a, b):
    return math.dist(a[:2], b[:2]) < 2e-3 and abs(math.remainder(a[2] - b[2], 2 * math.pi)) < 5e-3


class Panel:
    """Equal axes about some ways, in a frame of 216 by 150 px."""

    def __init__(self, ways):
        xs, ys = [p[0] for way in ways for p in way], [p[1] for way in ways for p in way]
        self.middle = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
        self.scale = max(1.16 * (max(xs) - min(xs)) / 216, 1.1 * (max(ys) - min(ys)) / 150, LEAST_M / 150)

    def at(self, x, y):
        return 188 + (x - self.middle[0]) / self.scale, 135 - (y - self.middle[1]) / self.scale

    def line(self, points, colour, dash="", fill="none"):
        text = " ".join("{:.2f},{:.2f}".format(*self.at(*p[:2])) for p in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        return f'<polyline points="{text}" fill="{fill}" stroke="{colour}" stroke-width="2"{dashed}/>'

    def way(self, way, colour, dash=""):
        x, y = self.at(*way[-1][:2])
        heading = f'{x + 20 * math.cos(way[-1][2]):.2f}" y2="{y - 20 * math.sin(way[-1][2]):.2f}'
        return (self.line(way, colour, dash) + f'<line x1="{x:.2f}" y1="{y:.2f}" x2="{heading}" stroke="{colour}" '
                f'stroke-width="2" opacity="0.7"/><circle cx="{x:.2f}" cy="{y:.2f}" r="4" fill="{colour}"/>')

    def axes(self):
        step = next(d * 10.0 ** e for e in range(-3, 2) for d in (1, 2, 5) if d * 10.0 ** e > 55 * self.scale)
        text = '<g font-size="11" fill="#6b6b6b" text-anchor="middle">'
        for k in range(-100, 101):
            x, y = self.at(k * step, k * step)
            name = f"{k * step:.3g}".replace("-", "−")
            if 80 <= x <= 296:
                text += f'<path d="M{x:.2f} 210v5" stroke="#b5b5b5"/><text x="{x:.2f}" y="228">{name}</text>'
            if 60 <= y <= 210:
                text += (f'<path d="M80 {y:.2f}h216" stroke="#e9e9e9"/>'
                         f'<text x="73" y="{y + 4:.2f}" text-anchor="end">{name}</text>')
        return (text + '<path d="M80 210h216" stroke="#b5b5b5"/><text x="188" y="248">x, m</text>'
                '<text x="18" y="135" transform="rotate(-90 18 135)">y, m</text></g>')

    def place(self, values):
        """Where in the world an effect lies: a disc, a centre, a line, a direction."""
        text = ""
        if "radius" in values:
            disc = [(values["x"] - START[0] + values["radius"] * math.cos(k * math.pi / 18),
                     values["y"] - START[1] + values["radius"] * math.sin(k * math.pi / 18)) for k in range(37)]
            text += self.line(disc, PALE, "6 4", "#99999922")
        elif "k1" in values:
            x, y = self.at(values["x"] - START[0], values["y"] - START[1])
            text += f'<circle cx="{x:.2f}" cy="{y:.2f}" r="2.3" fill="{PALE}"/>'
        if "position" in values:
            at = values["position"] - START[0]
            text += self.line([(at, -100), (at, 100)], PALE, "6 4")
        if "direction" in values:
            (x, y), a = self.at(0, 0), values["direction"]
            text += (f'<g transform="translate({x:.2f} {y:.2f}) rotate({-math.degrees(a):.1f})">'
                     f'<path d="M0 0H40m-5-3l5 3l-5 3" fill="none" stroke="{PALE}" stroke-width="1.3"/></g>')
        return text


def panel(command, without, withs, values):
    shown = Panel([without, *withs])
    apart = [(math.dist(without[-1][:2], w[-1][:2]), abs(math.remainder(w[-1][2] - without[-1][2], 2 * math.pi)))
             for w in withs]
    upto = "up to " if len(withs) > 1 else ""
    note = "end differs by " + ", ".join(f"{upto}{1e3 * max(a[k] for a in apart):.0f} {unit}"
                                         for k, unit in enumerate(("mm", "mrad")))
    return (f'<text x="18" y="30" font-size="16" fill="#222222" font-weight="600">{command}</text>'
            f'<text x="18" y="46" font-size="11" fill="#6b6b6b">{note}</text>' + shown.axes() +
            '<g clip-path="url(#frame)">' + shown.place(values) + shown.way(without, GREY, "6 4") +
            "".join(shown.way(w, BLACK) for w in withs) + "</g>")


def picture(effect, values, without, withs):
    stated = ", ".join(f"{p['key']} = " + (f"{values[p['key']]:.4g} {p['unit']}".removesuffix(" -")
                                           if "choices" not in p else values[p["key"]])
                       for p in effect["parameters"])
    text = ('<svg xmlns="http://www.w3.org/2000/svg" width="960" height="602" viewBox="0 0 960 602" font-family="\'Source '
            "Sans 3', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif\">"
            '<rect width="100%" height="100%" fill="#ffffff"/>'
            '<clipPath id="frame"><rect x="80" y="60" width="216" height="150"/></clipPath>'
            f'<text x="18" y="30" font-size="19" fill="#222222" font-weight="600">{effect["name"]}</text>'
            f'<text x="18" y="50" font-size="12" fill="#6b6b6b">{stated}</text>'
            f'<g font-size="12" stroke-width="3"><path d="M18 68h26" stroke="{GREY}" stroke-dasharray="6 4"/>'
            f'<path d="M116 68h26" stroke="{BLACK}"/></g><text x="51" y="72" font-size="12">without</text>'
            f'<text x="149" y="72" font-size="12">with {effect["name"]}</text>')
    for k, command in enumerate(DUTIES):
        distinct = []
        for way in withs[command]:
            if not any(alike(way[-1], other[-1]) for other in distinct):
                distinct.append(way)
        text += (f'<g transform="translate({320 * (k % 3)} {78 + 262 * (k // 3)})">' +
                 panel(command, without[command][0], distinct, values) + "</g>\n")
    return text + "</svg>\n"


def main():
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/pictures/effects"
    out.mkdir(parents=True, exist_ok=True)
    for effect in json.loads(subprocess.check_output([GAPFARM, "effects", "--json"])):
        values = {p["key"]: p["neutral"] + 0.3 * (p["upper"] - p["neutral"]) if "neutral" in p
                  else p["choices"][int(p["default"])] if "choices" in p else p["default"]
                  for p in effect["parameters"]}
        with tempfile.TemporaryDirectory() as folder:
            plan(Path(folder) / "plan.csv", effect["name"] == "backlash")
            without = drives(Path(folder), {})
            withs = drives(Path(folder), {f"{effect['name']}.{key}": value for key, value in values.items()})
        (out / f"{effect['name']}.svg").write_text(picture(effect, values, without, withs))


if __name__ == "__main__":
    main()
