#!/usr/bin/env python3
"""page_cost.py CONFIG [--pairs N] [--generations G] [--workers W]

What an open page costs: runs in pairs, one of them with `gapfarm serve` and a page open on it, which
listens to the server's events and fetches what is new, as live.js does; the browser's own drawing is
not in it.  Prints evaluations a second and the master's own CPU time an evaluation, pair by pair, and
the server's share of a core.  GAPFARM: the program, build/release/bin/gapfarm unless told otherwise.
"""

import argparse
import http.client
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
    """One open page: an event stream, and a fetch of what it tells of."""

    def __init__(self, port, run):
        super().__init__(daemon=True)
        self.port, self.run_name = port, run
        self.fetched = self.bytes = 0

    def run(self):
        stream = http.client.HTTPConnection("127.0.0.1", self.port)
        stream.request("GET", f"/events?at=/view&of={self.run_name}")
        answer, pages, etag = stream.getresponse(), None, ""
        while line := answer.readline():
            told = line.decode().removeprefix("data: ").strip()
            if not line.startswith(b"data: ") or f'"{told}"' == etag:
                continue
            pages = pages or http.client.HTTPConnection("127.0.0.1", self.port)
            pages.request("GET", f"/view?of={self.run_name}", headers={"If-None-Match": etag})
            page = pages.getresponse()
            self.bytes += len(page.read())
            self.fetched += page.status == 200
            etag = page.getheader("ETag") or ""


def one_run(options, with_page):
    """(evaluations a second, master's ms an evaluation, server's share of a core, page)"""
    folder = tempfile.mkdtemp(prefix="page-cost-")
    run = f"{folder}/run"
    server = page = None
    if with_page:
        server = subprocess.Popen(
            [GAPFARM, "serve", folder, "--port", "0"], stdout=subprocess.PIPE, text=True
        )
        port = int(re.search(r"127\.0\.0\.1:(\d+)", server.stdout.readline())[1])
    words = [GAPFARM, "evolve", options.config, "--out", run, "--workers", str(options.workers)]
    words += ["--generations", str(options.generations), "--log-level", "error"]
    began = time.monotonic()
    master = subprocess.Popen(words, stdout=subprocess.DEVNULL)
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
    options = parser.parse_args()
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
    spread = [100 * statistics.stdev(v) / len(v) ** 0.5 if len(v) > 1 else 0 for v in (rates, costs)]
    print(
        f"with a page: rate {100 * statistics.mean(rates):+.1f} % (standard error {spread[0]:.1f}), "
        f"master's CPU {100 * statistics.mean(costs):+.1f} % ({spread[1]:.1f}), "
        f"server {100 * statistics.mean(shares):.2f} % of a core, at most {100 * max(shares):.2f}"
    )


if __name__ == "__main__":
    main()
