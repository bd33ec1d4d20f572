#!/usr/bin/env python3
"""Table (Markdown) of what gapfarm understands of every URDF in a folder.

    scripts/urdf_table.py build/release/bin/gapfarm FOLDER
"""
import json
import pathlib
import subprocess
import sys


def row(gapfarm, path):
    done = subprocess.run([gapfarm, 'robot', str(path), '--json'], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True)
    out = json.loads(done.stdout)
    if done.returncode != 0:
        message = out['error']['message'].split(': ', 1)[1].split(', expected')[0]
        return f'| {path.name} | refused | | | | {message} |'
    driven = [w for w in out['wheels'] if w['driven']]
    radii = sorted({round(1e3 * w['radius'], 1) for w in driven})
    ys = [w['y'] for w in driven]
    mass = '' if out['mass'] is None else f"{out['mass']:.4g}"
    said = '; '.join(d.split(': ', 1)[-1] for d in out['disagreements'])
    return (f"| {path.name} | {out['drive']} | {', '.join(f'{r:g}' for r in radii)} | "
            f"{1e3 * (max(ys) - min(ys)):.4g} | {mass} | {said} |")


def main():
    gapfarm, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    print('| file | drive | radius mm | track mm | mass kg | disagreements, or why not |')
    print('|---|---|---|---|---|---|')
    for path in sorted(folder.glob('*.urdf')):
        print(row(gapfarm, path))


if __name__ == '__main__':
    main()
