#!/usr/bin/env python3
"""Makes cases "real log, wrong robot" of public logs of ground robots.

    scripts/wrong_robots.py DATA OUT [CASE ...]

DATA is what scripts/ground_sets.py reads.  A plain kinematic model (scripts/plain_kinematics.py) is
fitted to the untouched fit part of every set; then exactly one thing of the robot's file or of the log
is made wrong, or nothing.  Writes OUT/CASE/robot.toml, OUT/CASE/fit and OUT/CASE/test, and
OUT/truth/CASE.json: what was done, how far it stands out of the model's residuals (`visible`: mean
squared residual with the error over without), and by how many of the model's standard errors
(`sigmas`; `bound` is the standard error, the least that any unbiased estimate has when the model is
right).  scripts/diagnose_ground.sh diagnoses OUT.  SEED: what is drawn.  Standard library only.
"""
import json
import math
import os
import random
import sys
import tempfile

import ground_sets
import plain_kinematics as plain

SEED = int(os.environ.get("SEED", "20261124"))


class Log:
    """Runs of (commands, poses): rows (t, values) and (t, x, y, theta)."""

    def __init__(self, runs):
        self.runs = runs

    @staticmethod
    def read(folder):
        runs = {}
        for name, which in (("commands.csv", 0), ("poses.csv", 1)):
            for run, *row in ground_sets.numbers(os.path.join(folder, name), 1):
                row = (row[0], row[1:]) if which == 0 else tuple(row)
                runs.setdefault(run, ([], []))[which].append(row)
        return Log([r for r in runs.values() if r[0] and len(r[1]) > 1])

    def write(self, folder, channels, first=0):
        os.makedirs(folder, exist_ok=True)
        for name, head, which in (("commands.csv", channels, 0), ("poses.csv", ["x", "y", "theta"], 1)):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(",".join(["run", "t", *head]) + "\n")
                for i, run in enumerate(self.runs, first + 1):
                    for row in run[which]:
                        values = row[1] if which == 0 else row[1:]
                        file.write(f"{i},{row[0]:.4f}," + ",".join(f"{v:.6g}" for v in values) + "\n")

    def cut(self, seconds):
        """Runs of at most so many seconds."""
        runs = []
        for commands, poses in self.runs:
            begin = poses[0][0]
            while begin + seconds / 2 < poses[-1][0]:
                inside = [p for p in poses if begin <= p[0] < begin + seconds]
                before = [c for c in commands if c[0] <= begin]
                during = [c for c in commands if begin < c[0] < begin + seconds]
                rows = ([(begin, before[-1][1])] if before else []) + during
                if len(inside) > 1 and rows:
                    runs.append((rows, inside))
                begin += seconds
        return Log(runs)

    def ends(self):
        return Log([(c, [p[0], p[-1]]) for c, p in self.runs])


def retimed(runs):
    """One session clock, about 10 s between runs."""
    out, clock = [], 0.0
    for commands, poses in runs:
        start = min(commands[0][0], poses[0][0])
        shift = clock - start
        out.append(([(t + shift, v) for t, v in commands], [(p[0] + shift, *p[1:]) for p in poses]))
        clock += max(commands[-1][0], poses[-1][0]) - start + ground_sets.REST_S
    return out


# Set: the source of scripts/ground_sets.py, kind of model, s of a run (None: whole), only the runs'
# ends, runs to fit, runs to test.
SETS = {
    "car_a": ("dart_rubber", "car", 20, False, 6, 4),
    "car_b": ("dart_rubber", "car", 20, False, 6, 4),
    "diff_a": ("opti_diff", "sides", None, False, 4, 2),
    "diff_b": ("opti_diff", "sides", None, False, 2, 2),
    "diff_ends": ("opti_diff", "sides", None, True, 10, 5),
    "neato_a": ("neato", "sides", None, True, 10, 5),
    "neato_b": ("neato", "sides", None, True, 10, 5),
    "omni3": ("opti_omni3", "omni", None, False, 4, 2),
    "omni4": ("opti_omni4", "omni", None, False, 4, 2),
    "tricycle_a": ("opti_tricycle", "tricycle", None, False, 3, 2),
    "tricycle_b": ("tricycle_calib", "tricycle", 15, False, 4, 3),
    "skid_a": ("drive_asphalt", "sides", None, False, 40, 20),
    "skid_b": ("drive_gravel", "sides", None, False, 40, 20),
    "skid_c": ("drive_sand", "sides", None, False, 40, 20),
    "create_a": ("mrclam_1", "sides", 150, False, 1, 1),
    "create_b": ("mrclam_2", "sides", 150, False, 1, 1),
    "create_c": ("mrclam_3", "sides", 75, False, 2, 2),
}

# Case: error and its size; every set's first case is its null.  "file" sizes are of the file over what
# is right, less 1 (ratios), or added to it; "log" sizes are of the log.
ERRORS = {
    "car_a": [("battery_sag", 0.05), ("steering_offset", 0.0175), ("pose_quantisation", 0.02)],
    "car_b": [("marker_y", 0.02), ("wheelbase", 0.1), ("stale_frames", 0.2)],
    "diff_a": [("marker_y", 0.02), ("pose_quantisation", 0.01), ("stale_frames", 0.15)],
    "diff_b": [("right", 0.03), ("unit_error", 100), ("battery_sag", 0.03)],
    "diff_ends": [("separation", 0.048), ("asymmetry", 0.97), ("marker_yaw", 0.05)],
    "neato_a": [("separation", 0.048), ("radius", 0.03), ("pose_quantisation", 0.05)],
    "neato_b": [("separation", -0.06), ("left", 0.02), ("heading_flipped", None)],
    "omni3": [("radius", 0.02), ("marker_yaw", 0.05), ("turn", 0.05)],
    "omni4": [("pose_quantisation", 0.01), ("command_delay", 0.15), ("turn", 0.06)],
    "tricycle_a": [("wheelbase", 0.08), ("steering_offset", 0.03), ("pose_quantisation", 0.01)],
    "tricycle_b": [("steering_gain", 0.08), ("steering_offset", 0.02), ("marker_x", 0.1)],
    "skid_a": [("separation", 0.12), ("pose_quantisation", 0.1), ("lag", 0.4)],
    "skid_b": [("marker_y", 0.02), ("command_delay", 0.2), ("stale_frames", 0.2)],
    "skid_c": [("left", 0.08), ("sides_swapped", None), ("right", -0.06)],
    "create_a": [("separation", 0.1), ("lag", 0.4), ("stale_frames", 0.3)],
    "create_b": [("command_delay", 0.25), ("acceleration_limit", 0.15), ("clock_drift", 0.002)],
    "create_c": [("right", -0.05), ("pose_quantisation", 0.02), ("marker_y", 0.05)],
}

NAMES = {
    "left": (["wheel_radius", "motor_asymmetry"], "ratio"),
    "right": (["wheel_radius", "motor_asymmetry"], "ratio"),
    "asymmetry": (["wheel_radius", "motor_asymmetry"], "ratio"),
    "radius": (["wheel_radius", "speed_gain"], "ratio"),
    "separation": (["wheel_separation", "icr_track"], "ratio"),
    "turn": (["wheel_separation", "robot_radius", "turn_gain"], "ratio"),
    "wheelbase": (["wheelbase", "steering_gain"], "ratio"),
    "steering_gain": (["steering_gain", "wheelbase"], "ratio"),
    "steering_offset": (["steering_offset"], "angle"),
    "lag": (["motor_lag", "steering_lag"], "tau"),
    "command_delay": (["command_delay", "pose_latency", "clock_offset"], "latency"),
    "acceleration_limit": (["acceleration_limit", "motor_lag"], "ramp"),
    "marker_x": (["marker_offset", "com_offset"], "x"),
    "marker_y": (["marker_offset", "com_offset"], "y"),
    "marker_yaw": (["marker_yaw", "heading_offset"], "angle"),
    "battery_sag": (["battery_sag"], "rate"),
    "clock_drift": (["clock_drift"], "rate"),
    "pose_quantisation": (["pose_quantisation"], "step"),
    "stale_frames": (["stale_frames"], "share"),
    "unit_error": (["unit_error", "pose_units"], None),
    "sides_swapped": (["sides_swapped"], None),
    "heading_flipped": (["heading_flipped"], None),
}
# Of the plain model: which value's standard error a size is compared with, and of how much of it.
VALUE_OF = {"asymmetry": "right", "turn": "separation", "command_delay": "delay", "radius": "left"}


def wrong_file(model, values, error, size):
    """What the file then has, and what a diagnosis should report."""
    wrong = dict(values)
    if error in ("left", "right", "separation", "steering_gain"):
        wrong[error] = values[error] * (1 + size)
        return wrong, 1 / (1 + size) - 1
    if error == "turn":
        wrong["separation"] = values["separation"] * (1 + size)
        return wrong, 1 / (1 + size) - 1
    if error == "radius":
        for name in ("left", "right", "ahead"):
            if name in wrong:
                wrong[name] = values[name] * (1 + size)
        return wrong, 1 / (1 + size) - 1
    if error == "wheelbase":
        wrong["wheelbase"] = model.wheelbase * (1 + size)
        return wrong, 1 / (1 + size) - 1
    if error == "acceleration_limit":
        wrong["acceleration_limit"] = size
        return wrong, -1 / size
    wrong[error] = values[error] + size
    return wrong, -size


def wrong_runs(runs, error, size, model, rng):
    """What the log then has, and what a diagnosis should report."""
    begin = runs[0][0][0][0]
    out = []
    for commands, poses in runs:
        if error == "battery_sag":  # what was commanded is written down as more than it was, later more so
            commands = [(t, [v / (1 - size * (t - begin) / 60) if c in model.driving else v
                             for c, v in enumerate(values)]) for t, values in commands]
        elif error == "asymmetry":
            commands = [(t, [values[0], size * values[1]] if model.channels[1] == "right"
                         else [size * values[0], values[1]]) for t, values in commands]
        elif error == "sides_swapped":
            commands = [(t, values[::-1]) for t, values in commands]
        elif error == "command_delay":
            poses = [(p[0] + size, *p[1:]) for p in poses]
        elif error == "clock_drift":
            commands = [(t - size * (t - begin), v) for t, v in commands]
        elif error == "pose_quantisation":
            poses = [(t, size * round(x / size), size * round(y / size), a) for t, x, y, a in poses]
        elif error == "unit_error":
            poses = [(t, size * x, size * y, a) for t, x, y, a in poses]
        elif error == "heading_flipped":
            poses = [(t, x, y, -a) for t, x, y, a in poses]
        elif error == "stale_frames":
            rows = [poses[0]]
            for p in poses[1:]:
                rows.append((p[0], *(rows[-1][1:] if rng.random() < size else p[1:])))
            poses = rows
        out.append((commands, poses))
    value = {"asymmetry": 1 / size - 1 if size else None, "unit_error": None}.get(error, size)
    return out, value


IN_LOG = {"battery_sag", "asymmetry", "sides_swapped", "command_delay", "clock_drift", "pose_quantisation",
          "unit_error", "heading_flipped", "stale_frames"}


def write_case(out, name, model, values, fit, test, truth):
    folder = os.path.join(out, name)
    fit.write(os.path.join(folder, "fit"), model.channels)
    test.write(os.path.join(folder, "test"), model.channels, len(fit.runs))
    with open(os.path.join(folder, "robot.toml"), "w", encoding="utf-8") as file:
        file.write(model.robot_file(values))
    os.makedirs(os.path.join(out, "truth"), exist_ok=True)
    with open(os.path.join(out, "truth", name + ".json"), "w", encoding="utf-8") as file:
        json.dump(truth, file, indent=1)


def runs_of(data, which, seconds, ends, count, rng):
    with tempfile.TemporaryDirectory() as folder:
        make, argument = ground_sets.SETS[which]
        make(data, folder, argument)
        parts = [Log.read(os.path.join(folder, part)) for part in ("fit", "test")]
        with open(os.path.join(folder, "robot.toml"), encoding="utf-8") as file:
            robot = file.read()
    log = Log(parts[0].runs + parts[1].runs)
    if 'commands = ["v", "omega"]' in robot:  # as wheel speeds of the maker's sizes
        half, radius = (plain.tomllib.loads(robot)[key] for key in ("wheel_separation", "wheel_radius"))
        log = Log([([(t, [(v - w * half / 2) / radius, (v + w * half / 2) / radius])
                     for t, (v, w) in commands], poses) for commands, poses in log.runs])
    if seconds:
        log = log.cut(seconds)
    if ends:
        log = log.ends()
    picked = rng.sample(range(len(log.runs)), min(count, len(log.runs)))
    return robot, retimed([log.runs[i] for i in picked]), picked


def make_set(data, out, set_name, wanted):
    source, kind, seconds, ends, fitted, tested = SETS[set_name]
    rng = random.Random(f"{SEED} {set_name}")
    robot, runs, picked = runs_of(data, source, seconds, ends, fitted + tested, rng)
    model = plain.Model(kind, robot, ends)
    values, bounds = model.fit(runs[:fitted])
    right = model.misfit(runs, values)
    for k, (error, size) in enumerate([("none", None)] + ERRORS[set_name]):
        name = f"{set_name}_{k}_{error}"
        if wanted and name not in wanted and set_name not in wanted:
            continue
        bad_values, bad_runs, value = values, runs, None
        if error in IN_LOG:
            bad_runs, value = wrong_runs(runs, error, size, model, random.Random(f"{SEED} {name}"))
        elif error != "none":
            bad_values, value = wrong_file(model, values, error, size)
        expected, parameter = NAMES.get(error, ([], None))
        steering = "steering_gain" if kind == "tricycle" else "steering_left"
        bound = bounds.get(VALUE_OF.get(error, steering if error == "wheelbase" else error))
        visible = model.misfit(bad_runs, bad_values) / right
        write_case(out, name, model, bad_values, Log(bad_runs[:fitted]), Log(bad_runs[fitted:]), {
            "set": set_name, "error": error, "where": "log" if error in IN_LOG else "robot file",
            "expected": expected, "parameter": parameter, "value": value, "injected": size,
            "visible": round(visible, 3), "bound": bound,
            "sigmas": round(abs(value) / bound, 1) if bound and value else None,
            "seed": SEED, "fit_runs": fitted, "test_runs": tested, "source": source, "runs": picked,
            "right_file": {n: round(v, 5) for n, v in values.items()}})
        print(name, "visible", round(visible, 2), "value", value, "bound", bound, flush=True)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    data, out = sys.argv[1:3]
    wanted = set(sys.argv[3:])
    for set_name in SETS:
        if not wanted or any(w.startswith(set_name) for w in wanted):
            make_set(data, out, set_name, wanted)


if __name__ == "__main__":
    main()
