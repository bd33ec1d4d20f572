#!/usr/bin/env python3
"""How much log a ground robot's fit needs: errors over 5 s of driving that was not fitted, by seconds of driving that were.

  scripts/learning_curve.py SETS OUT SET... [--seconds 5 10 20 30 45 120] [--from 0 60 120]

SETS as scripts/measure_ground.sh has them (scripts/ground_sets.py makes them of public logs); that script fits and
measures, with BIN as it says.  A log is cut at --seconds of driving after each of --from seconds of it.  Prints a
table of median errors (the median over --from, and the worst; inf where the fitted robot falls over).
"""
import argparse
import csv
import math
import os
import pathlib
import shutil
import statistics
import subprocess

HERE = pathlib.Path(__file__).parent


def rows_of(path):
    with open(path, newline='') as file:
        return list(csv.DictReader(file))


def cut(source, target, begin_s, seconds):
    """The runs of `source` from `begin_s` of driving on, until there are `seconds`."""
    poses, commands = rows_of(source / 'poses.csv'), rows_of(source / 'commands.csv')
    spans = {}
    for row in poses:
        t = float(row['t'])
        first, _ = spans.get(row['run'], (t, t))
        spans[row['run']] = (first, t)
    kept, passed, left = {}, 0.0, seconds
    for run, (first, last) in spans.items():
        passed += last - first
        if passed <= begin_s or left <= 0:
            continue
        kept[run] = first + min(left, last - first)
        left -= last - first
    target.mkdir(parents=True, exist_ok=True)
    for name, rows in (('poses.csv', poses), ('commands.csv', commands)):
        with open(target / name, 'w', newline='') as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator='\n')
            writer.writeheader()
            writer.writerows(r for r in rows if r['run'] in kept and float(r['t']) <= kept[r['run']])
    return seconds - max(left, 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sets', type=pathlib.Path)
    parser.add_argument('out', type=pathlib.Path)
    parser.add_argument('names', nargs='+', metavar='SET')
    parser.add_argument('--seconds', type=float, nargs='+', default=[5, 10, 20, 30, 45, 120])
    parser.add_argument('--from', dest='begins', type=float, nargs='+', default=[0, 60, 120])
    options = parser.parse_args()
    print('| set | s of log | mm after 5 s: median, worst | mrad: median, worst |\n|---|---|---|---|')
    for name in options.names:
        source = options.sets / name
        for seconds in options.seconds:
            errors = []
            for begin in options.begins:
                case = f'{name}_{seconds:g}_{begin:g}'
                folder = options.out / 'sets' / case
                if cut(source / 'fit', folder / 'fit', begin, seconds) < seconds - 1:
                    continue
                shutil.copy(source / 'robot.toml', folder / 'robot.toml')
                shutil.copytree(source / 'test', folder / 'test', dirs_exist_ok=True)
                table = subprocess.run([HERE / 'measure_ground.sh', options.out / 'sets', options.out / 'runs', case],
                                       capture_output=True, text=True, env=os.environ, check=False).stdout
                found = [[cell.strip() for cell in line.split('|')] for line in table.splitlines()]
                at_5 = [row for row in found if len(row) > 5 and row[1] == case and row[2] == '5']
                # So short a log may fit a robot that does not stay on its wheels.
                errors.append([float(x) for x in at_5[0][5].split(',')] if at_5 else [math.inf, math.inf])
            if errors:
                mm, mrad = zip(*errors)
                print(f'| {name} | {seconds:g} | {statistics.median(mm):.0f}, {max(mm):.0f} | '
                      f'{statistics.median(mrad):.0f}, {max(mrad):.0f} |', flush=True)


if __name__ == '__main__':
    main()
