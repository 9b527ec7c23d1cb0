# SPDX-License-Identifier: MIT
"""The number of threads that the program chooses against fixed numbers, in turn on walls of many sizes.

    python benchmarks/threads.py build/bin/rockdda                     on the machine as it is
    python benchmarks/threads.py build/bin/rockdda --beside 2          beside two jobs that only compute

Prints for each size the median wall clock of the steps (a run without steps is taken off) with the default and with
each fixed number, and the default over the best of these.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from works import write_wall

#: Steps of each run, by the number of blocks.
STEPS = {50: 200, 500: 40, 2000: 20, 5000: 12, 10_000: 8, 30_000: 4, 100_000: 3}


def wall_clock(program: Path, files: tuple[str, str], folder: Path, steps: int, threads: int) -> float:
    """Seconds of one run; threads 0: the choice of the program."""
    command = [str(program), "run", *files, "--dialect", "g0", "--steps", str(steps), "--save-every", "1000"]
    command += ["--force", "--quiet", "-o", str(folder / "out.h5"), *(["--threads", str(threads)] if threads else [])]
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("OMP_", "GOMP_"))}
    begun = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=environment)
    return time.perf_counter() - begun


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--beside", type=int, default=0, help="number of busy jobs beside the runs")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--sizes", default=",".join(map(str, STEPS)))
    parser.add_argument("--threads", default=",".join(str(n + 1) for n in range(os.cpu_count() or 1)))
    options = parser.parse_args(arguments)
    choices = [0, *map(int, options.threads.split(","))]
    jobs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(options.beside)]
    print(f"{options.beside} other jobs, load {os.getloadavg()[0]:.1f}; wall clock of a step [ms]")
    print("blocks | default | " + " | ".join(f"{n} thread(s)" for n in choices[1:]) + " | default over the best")
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for size in map(int, options.sizes.split(",")):
                steps = STEPS.get(size, max(3, 100_000 // size))
                files = write_wall(folder / f"wall_{size}", size, 1)
                times: dict[int, list[float]] = {choice: [] for choice in choices}
                for repeat in range(options.repeats):
                    for choice in choices if repeat % 2 == 0 else reversed(choices):
                        start = wall_clock(options.program, files, folder, 0, choice)
                        total = wall_clock(options.program, files, folder, steps, choice)
                        times[choice].append(1e3 * (total - start) / steps)
                middle = {choice: statistics.median(values) for choice, values in times.items()}
                ratio = middle[0] / min(middle[choice] for choice in choices[1:])
                row = " | ".join(f"{middle[choice]:.2f}" for choice in choices)
                print(f"{size} | {row} | {ratio:.2f}", flush=True)
    finally:
        for job in jobs:
            job.kill()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
