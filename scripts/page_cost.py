#!/usr/bin/env python3
"""page_cost.py CONFIG [--pairs N] [--generations G] [--workers W] [--bench BENCH_FARM]

What an open page costs: runs in pairs, one of them with `gapfarm serve` and a page open on it, which
listens to the server's events and fetches what is new, as live.js does; the browser's own drawing is
not in it.  Prints evaluations a second and the master's own CPU time an evaluation, pair by pair, and
the server's share of a core.

With --bench, `bench_farm` runs beside each run instead, and what its master costs is printed: CPU time
of its thread a task, and tasks a second.

GAPFARM: the program, build/release/bin/gapfarm unless configured otherwise.
"""

import argparse
import http.client
import json
import os
import re
import shutil
import sqlite3
import statistics
import subprocess
import tempfile
import threading
import time
from pathlib import Path

TASKS_OF_A_BATCH = 20000  # of bench_farm's throughput
HERE = Path(__file__).resolve().parent.parent
GAPFARM = os.environ.get("GAPFARM", str(HERE / "build/release/bin/gapfarm"))


def cpu_s(pid):
    """Of the process itself, without its children: all of its threads, to the microsecond."""
    try:
        threads = Path(f"/proc/{pid}/task").iterdir()
        return 1e-9 * sum(int((t / "schedstat").read_text().split()[0]) for t in threads)
    except (FileNotFoundError, ProcessLookupError):
        return None


class Page(threading.Thread):
    """One open page: an event stream, and a fetch of what it names."""

    def __init__(self, port, run):
        super().__init__(daemon=True)
        self.port, self.run_name = port, run
        self.fetched = self.bytes = 0

    def run(self):
        stream = http.client.HTTPConnection("127.0.0.1", self.port)
        stream.request("GET", f"/events?at=/view&of={self.run_name}")
        answer, pages, etag = stream.getresponse(), None, ""
        while line := answer.readline():
            reported = line.decode().removeprefix("data: ").strip()
            if not line.startswith(b"data: ") or f'"{reported}"' == etag:
                continue
            pages = pages or http.client.HTTPConnection("127.0.0.1", self.port)
            pages.request("GET", f"/view?of={self.run_name}", headers={"If-None-Match": etag})
            page = pages.getresponse()
            self.bytes += len(page.read())
            self.fetched += page.status == 200
            etag = page.getheader("ETag") or ""


def serve(folder):
    """The server, and its port."""
    server = subprocess.Popen(
        [GAPFARM, "serve", folder, "--port", "0"], stdout=subprocess.PIPE, text=True
    )
    return server, int(re.search(r"127\.0\.0\.1:(\d+)", server.stdout.readline())[1])


def begin_run(options, run, generations):
    words = [GAPFARM, "evolve", options.config, "--out", run, "--workers", str(options.workers)]
    words += ["--generations", str(generations), "--log-level", "error"]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def one_bench(options, with_page):
    """(tasks a second, us of CPU a task of bench_farm's master): beside a run that goes on, with or
    without a page open on it."""
    folder = tempfile.mkdtemp(prefix="page-cost-")
    run = f"{folder}/run"
    master, server = begin_run(options, run, 10**6), None
    while not Path(f"{run}/run.sqlite").exists() and master.poll() is None:
        time.sleep(0.05)
    if with_page:
        server, port = serve(folder)
        Page(port, run).start()
    time.sleep(3)
    words = [options.bench, "--benchmark_filter=throughput/link:0/workers:1/"]
    words += ["--benchmark_format=json", "--benchmark_min_time=2"]
    said = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    result = json.loads(said[said.index("{") :])["benchmarks"][0]
    for process in (master, server):
        if process:
            process.terminate()
            process.wait()
    shutil.rmtree(folder, ignore_errors=True)
    us = {"ns": 1e-3, "us": 1, "ms": 1e3, "s": 1e6}[result["time_unit"]]
    return result["items_per_second"], us * result["cpu_time"] / TASKS_OF_A_BATCH


def change(values):
    """"+1.2 % (standard error 0.8, median +1.0)" """
    error = 100 * statistics.stdev(values) / len(values) ** 0.5 if len(values) > 1 else 0
    return (
        f"{100 * statistics.mean(values):+.1f} % (standard error {error:.1f}, median "
        f"{100 * statistics.median(values):+.1f})"
    )


def bench_in_pairs(options):
    rates, costs = [], []
    for pair in range(options.pairs):
        order = (False, True) if pair % 2 == 0 else (True, False)
        results = {with_page: one_bench(options, with_page) for with_page in order}
        (rate0, us0), (rate1, us1) = results[False], results[True]
        rates.append(rate1 / rate0 - 1)
        costs.append(us1 / us0 - 1)
        print(
            f"pair {pair + 1}: {rate0:.0f} and {rate1:.0f} tasks/s, {us0:.2f} and {us1:.2f} us of "
            "the master's CPU a task",
            flush=True,
        )
    print(f"bench_farm with a page open: rate {change(rates)}, CPU {change(costs)}")


def one_run(options, with_page):
    """(evaluations a second, master's ms an evaluation, server's share of a core, page)"""
    folder = tempfile.mkdtemp(prefix="page-cost-")
    run = f"{folder}/run"
    server = page = None
    if with_page:
        server, port = serve(folder)
    began = time.monotonic()
    master = begin_run(options, run, options.generations)
    of_master, of_server, served_from = 0.0, 0.0, None
    while master.poll() is None:
        time.sleep(0.05)
        of_master = cpu_s(master.pid) or of_master
        if with_page and page is None and Path(f"{run}/run.sqlite").exists():
            time.sleep(2.2)  # until the server has looked again
            page = Page(port, run)
            page.start()
            served_from = (time.monotonic(), cpu_s(server.pid))
    wall = time.monotonic() - began
    if page:
        of_server = (cpu_s(server.pid) - served_from[1]) / (time.monotonic() - served_from[0])
        server.terminate()
        server.wait()
    with sqlite3.connect(f"file:{run}/run.sqlite?mode=ro", uri=True) as store:
        (evaluations, seconds) = store.execute(
            "SELECT max(evaluations), sum(wall_s) FROM generations"
        ).fetchone()
    shutil.rmtree(folder)
    return evaluations / seconds, 1e3 * of_master / evaluations, of_server, page, wall


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("config")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--generations", type=int, default=100)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--bench", help="bench_farm, to be run beside each run")
    options = parser.parse_args()
    if options.bench:
        return bench_in_pairs(options)
    rates, costs, shares = [], [], []
    for pair in range(options.pairs):
        order = (False, True) if pair % 2 == 0 else (True, False)
        results = {with_page: one_run(options, with_page) for with_page in order}
        (rate0, ms0, *_), (rate1, ms1, share, page, wall) = results[False], results[True]
        rates.append(rate1 / rate0 - 1)
        costs.append(ms1 / ms0 - 1)
        shares.append(share)
        print(
            f"pair {pair + 1}: {rate0:.1f} and {rate1:.1f} evaluations/s, master {ms0:.3f} and "
            f"{ms1:.3f} ms an evaluation; server {100 * share:.2f} % of a core, page fetched "
            f"{page.fetched} times in {wall:.0f} s, {page.bytes / 1e6:.1f} MB",
            flush=True,
        )
    print(
        f"with a page: rate {change(rates)}, master's CPU {change(costs)}, "
        f"server {100 * statistics.mean(shares):.2f} % of a core, at most {100 * max(shares):.2f}"
    )


if __name__ == "__main__":
    main()
