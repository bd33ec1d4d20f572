"""A simulator for gapfarm in plain Python: two tracks that slip when they turn (docs/external.md)."""
import json
import math
import sys

STEP = 0.005  # s

DECLARATION = {
    "gapfarm": 1,
    "name": "two tracks",
    "inputs": ["lag", "path"],
    "parameters": [
        {"key": "full_speed", "unit": "m/s", "lower": 0.05, "upper": 1, "nominal": 0.3, "log": True},
        {"key": "gauge", "unit": "m", "lower": 0.05, "upper": 0.5, "nominal": 0.15,
         "summary": "effective distance of the tracks, slip included"},
    ],
}


def drive(task):
    p, sides, duration = task["parameters"], (task["left"], task["right"]), task["duration"]
    x = y = theta = t = 0.0
    speed, path, interval = [0.0, 0.0], [], task.get("interval", 0)
    settle = 10 * max(side["lag"] for side in sides)
    while t < duration + settle - STEP / 2:
        if interval and t >= len(path) * interval - STEP / 2:
            path.append([t, x, y, theta])
        for i, side in enumerate(sides):
            goal = side["speed"] * p["full_speed"] if t < duration - STEP / 2 else 0.0
            keep = math.exp(-STEP / side["lag"]) if side["lag"] > 0 else 0.0
            speed[i] = goal + (speed[i] - goal) * keep
        turn = (speed[1] - speed[0]) / p["gauge"] * STEP
        ahead = (speed[0] + speed[1]) / 2 * STEP
        x += ahead * math.cos(theta + turn / 2)
        y += ahead * math.sin(theta + turn / 2)
        theta, t = theta + turn, t + STEP
    path.append([t, x, y, theta])
    return {"id": task["id"], "pose": [x, y, theta], "path": path if interval else [], "rest": settle}


for line in sys.stdin:
    asked = json.loads(line)
    print(json.dumps(drive(asked) if "id" in asked else DECLARATION), flush=True)
