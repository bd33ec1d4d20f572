#!/usr/bin/env python3
"""Makes a table of diagnoses of the cases of scripts/wrong_robots.py: right, wrong, or out of sight?

    scripts/score_robots.py CASES DIAGNOSES

CASES holds truth/CASE.json, DIAGNOSES holds CASE/diagnosis.json (scripts/diagnose_ground.sh). A real
log has effects of its own, so what is named on the unchanged log of a set is its baseline. A case is
right when an expected name is given that the baseline lacks, with at most one more, or when a
parameter of an expected name differs from the baseline's by what was injected. An unchanged log is
right with at most one name. `nats` is what the error costs the unmoved file by the diagnosis' own
residuals, windows of several horizons counted once: below LEAST_NATS no test at 5 % sees it nine
times out of ten, whatever the method, and an unnamed error is out of sight. Standard library only.
"""
import json
import os
import sys

LEAST_NATS = 4.3  # (1.645 + 1.282)^2 / 2: size 5 %, power 90 %, one value, one side


def read(path):
    if not os.path.exists(path):
        return None
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def names_of(effect):
    return {effect["name"], *effect.get("aliases", [])[:3]}


def value_of(said, truth):
    """The named parameter, and half of its interval; 0 where it is not named."""
    for effect in said["effects"]:
        if names_of(effect) & set(truth["expected"]):
            for key, p in effect["parameters"].items():
                if key == truth["parameter"]:
                    return p["value"], (p["hi"] - p["lo"]) / 2
    return 0.0, 0.0


def scores_of(said):
    rows = [dict(zip(said["trials"]["columns"], row)) for row in said["trials"]["rows"]]
    return {(r["session"], round(r["session_time_s"], 2), r["command"]): r["tuned_score"] for r in rows}


def nats(null, said):
    a, b = scores_of(null), scores_of(said)
    both = set(a) & set(b)
    horizons = len({key[2] for key in both})
    return sum(a[k] - b[k] for k in both) / max(horizons, 1) if both else None


def judge(truth, said, null):
    """A word, and the nats."""
    named = [names_of(effect) for effect in said["effects"]]
    if truth["error"] == "none":
        return ("right" if len(named) <= 1 else "WRONG"), None
    baseline = set().union(*(names_of(e) for e in null["effects"])) if null["effects"] else set()
    new = [family for family in named if not family & baseline]
    hit = any(family & set(truth["expected"]) for family in new) and len(new) <= 2
    if truth["value"] is not None and not hit:
        (value, half), (before, _) = value_of(said, truth), value_of(null, truth)
        hit = value != 0 and abs(value - before - truth["value"]) < max(0.3 * abs(truth["value"]), half)
    cost = nats(null, said) if truth["where"] == "robot file" else None
    if hit:
        return "right", cost
    weak = truth["visible"] < 1.05 and (truth["sigmas"] or 0) < 3
    out_of_sight = cost is not None and cost < LEAST_NATS
    return ("out of sight" if (weak or out_of_sight) and not new else "WRONG"), cost


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    cases, diagnoses = sys.argv[1:]
    folder = os.path.join(cases, "truth")
    truths = {f[:-5]: read(os.path.join(folder, f)) for f in sorted(os.listdir(folder))}
    null_of = {t["set"]: c for c, t in truths.items() if t["error"] == "none"}
    counts = {}
    print("| case | made wrong by | visible | sigmas | nats | named | |\n|---|---|---|---|---|---|---|")
    for case, truth in truths.items():
        said = read(os.path.join(diagnoses, case, "diagnosis.json"))
        null = read(os.path.join(diagnoses, null_of[truth["set"]], "diagnosis.json"))
        if said is None or null is None:
            word, cost, names = "not run", None, ""
        else:
            word, cost = judge(truth, said, null)
            names = ", ".join(e["name"] for e in said["effects"]) or "nothing"
        kind = "unchanged" if truth["error"] == "none" else "errors"
        counts.setdefault(kind, {}).setdefault(word, []).append(case)
        show = lambda value, form: "" if value is None else format(value, form)
        print(f"| {case} | {show(truth['injected'], '.3g')} | {show(truth['visible'], '.2f')} | "
              f"{show(truth['sigmas'], '.1f')} | {show(cost, '.1f')} | {names} | {word} |")
    print()
    for kind, words in sorted(counts.items()):
        print(f"{kind}: " + ", ".join(f"{len(c)} {w}" for w, c in sorted(words.items())))


if __name__ == "__main__":
    main()
