#!/usr/bin/env python3
"""Prints the table of the numbers that steer a diagnosis, docs/evidence/settings.md.

    scripts/settings.py > docs/evidence/settings.md

Reads master/infer/settings.h: above each number stand its unit, where it comes from and what it
decides, parted by bars. Fails where one of them is missing, and where there are more than MOST.
"""
import pathlib
import re
import sys

MOST = 120
ROOT = pathlib.Path(__file__).resolve().parent.parent
TEXT = (ROOT / "master/infer/settings.h").read_text(encoding="utf-8")

print("""# The numbers that steer a diagnosis

What decides on names and verdicts, how far is looked, and how large something may be beforehand. All stand in
`master/infer/settings.h`, which this page is made from:

    scripts/settings.py > docs/evidence/settings.md

A number is *derived* from what it stands for, *cited*, *chosen* on the data that are named or *measured* on them; *round* is one
of which no measurement is on record.""")
rows, comment = 0, []
for line in TEXT.split("namespace gapfarm {\n", 1)[1].splitlines():
    if line.startswith("// -- "):
        print(f"\n## {line[6:]}\n\n| number | value | unit | origin | what it decides |\n|---|---|---|---|---|")
    elif line.startswith("//"):
        comment.append(line[2:].strip())
    elif found := re.match(r"inline constexpr [\w:]+ (\w+) = ([^;]+);", line):
        parts = [part.strip() for part in " ".join(comment).split(" | ")]
        if len(parts) != 3 or not all(parts):
            sys.exit(f"settings.h: {found[1]}: unit, origin and meaning, parted by bars, are to stand above it")
        print(f"| `{found[1]}` | {found[2]} | {' | '.join(parts)} |")
        rows, comment = rows + 1, []
if rows > MOST:
    sys.exit(f"settings.h: {rows} numbers, at most {MOST}: take a rule away before you add one")
print(f"\n{rows} numbers.")
