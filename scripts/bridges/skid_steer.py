"""A simulator for gapfarm that follows runs: a skid-steer's kinematics in plain Python (docs/external.md)."""
import json
import math
import sys

STEP = 0.01  # s


def parameter(key, unit, lower, upper, nominal, summary):
    return {"key": key, "unit": unit, "lower": lower, "upper": upper, "nominal": nominal, "summary": summary}


DECLARATION = {
    "gapfarm": 1,
    "name": "skid-steer",
    "channels": ["v", "omega"],  # of commands.csv: m/s, rad/s
    "parameters": [
        parameter("left_gain", "-", 0.5, 1.5, 1, "of the left side's speed"),
        parameter("right_gain", "-", 0.5, 1.5, 1, "of the right side's speed"),
        parameter("separation", "m", 0.2, 1, 0.5, "effective distance of the sides, slip included"),
        parameter("believed_separation", "m", 0.2, 1, 0.5, "what the controller takes it for"),
        parameter("lag", "s", 0.001, 1, 0.05, "time constant of the sides' speeds"),
    ],
}


def follow(task):
    """Poses [x, y, theta] at task["times"], in the frame of the first; a command holds until the next."""
    p, commands, t = task["parameters"], task["commands"], task["start"]["t"]
    half, believed, keep = p["separation"] / 2, p["believed_separation"] / 2, math.exp(-STEP / p["lag"])
    v, w = task["start"]["speed"], task["start"]["turn"]
    left, right = v - w * half, v + w * half
    x = y = theta = 0.0
    row, poses = -1, []
    for wanted in task["times"]:
        while t < wanted - 1e-9:
            step = min(STEP, wanted - t)
            while row + 1 < len(commands) and commands[row + 1][0] <= t + 1e-9:
                row += 1
            v, w = commands[row][1:] if row >= 0 else (0.0, 0.0)
            goal_left, goal_right = p["left_gain"] * (v - w * believed), p["right_gain"] * (v + w * believed)
            share = keep if step == STEP else math.exp(-step / p["lag"])
            left, right = goal_left + (left - goal_left) * share, goal_right + (right - goal_right) * share
            turn, ahead = (right - left) / (2 * half) * step, (left + right) / 2 * step
            x += ahead * math.cos(theta + turn / 2)
            y += ahead * math.sin(theta + turn / 2)
            theta, t = theta + turn, t + step
        poses.append([x, y, theta])
    return {"id": task["id"], "poses": poses}


for line in sys.stdin:
    asked = json.loads(line)
    print(json.dumps(follow(asked) if "id" in asked else DECLARATION), flush=True)
