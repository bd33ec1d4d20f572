"""An objective for gapfarm in plain Python: Rosenbrock's valley within a disc (docs/objective.md)."""
import json
import sys

DECLARATION = {
    "gapfarm": 1,
    "name": "Rosenbrock's valley",
    "parameters": [
        {"key": "x", "lower": -2, "upper": 2, "nominal": -1},
        {"key": "y", "lower": -2, "upper": 2, "nominal": 0.5},
    ],
}


def objective(x, y):
    return {"value": (1 - x) ** 2 + 100 * (y - x * x) ** 2,
            "violations": [x * x + y * y - 2]}    # feasible where none is above 0


for line in sys.stdin:
    asked = json.loads(line)
    answer = {"id": asked["id"], **objective(**asked["parameters"])} if "id" in asked else DECLARATION
    print(json.dumps(answer), flush=True)
