# SPDX-License-Identifier: MIT
"""Damaged results for the readers of the Python package.

    .venv/bin/python tests/fuzz/damaged_results.py RESULTS [--n 2000] [--seed 1] [--jobs 2] [--keep FOLDER]

A small results file is spoiled: bits and bytes that flip, zeros, pieces of the file at another place, an end that is
missing, and changes of its structure (datasets of other shapes, types and values, links, attributes). Each case is
read in a process of its own, of 2 GB and 10 s of processor time at most: opened, all arrays, frames, contacts and the
history read; some are exported, and a picture is drawn of them. It fails when the process does not end, is killed, or
meets anything else than an `InputError`. Case k of a seed is the same on every machine.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import subprocess
import sys
import tempfile
import traceback
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

MEMORY, SECONDS = 2 << 30, 10
FINE, REFUSED, FAILED = "read", "refused", "failed"


def spoil(good: bytes, k: int, seed: int, path: Path) -> str:
    """Make case k; what was done."""
    random_ = random.Random(f"{seed} {k}")
    kind = random_.choice(("bit", "byte", "bytes", "zeros", "moved", "short", "structure", "structure"))
    data = bytearray(good)
    # most of what matters lies at the beginning
    limit = len(good) if random_.random() < 0.5 else min(len(good), 16384)
    place = random_.randrange(limit)
    if kind == "bit":
        data[place] ^= 1 << random_.randrange(8)
    elif kind == "byte":
        data[place] = random_.choice((0, 1, 255, 127, random_.randrange(256)))
    elif kind == "bytes":
        for _ in range(random_.choice((2, 10, 100))):
            data[random_.randrange(limit)] = random_.randrange(256)
    elif kind == "zeros":
        n = random_.choice((4, 8, 64, 512, 4096))
        data[place : place + n] = bytes(len(data[place : place + n]))
    elif kind == "moved":
        n = random_.choice((8, 64, 512))
        start = random_.randrange(len(good))
        data[place : place + n] = good[start : start + n]
    elif kind == "short":
        del data[place:]
    path.write_bytes(data)
    if kind != "structure":
        return f"{kind} at {place}"
    import checkpoints
    import h5py

    with h5py.File(path, "r+") as file:
        done = []
        for _ in range(random_.choice((1, 1, 2))):
            try:
                done.append(random_.choice(checkpoints.CHANGES)(file, random_))
            except (KeyError, ValueError, TypeError, OSError, RuntimeError, IndexError):
                continue
    return "; ".join(done)


def read_all(path: Path, draw: bool) -> None:
    """Everything that a reader can ask for."""
    import rockdda

    with rockdda.open(path) as results:
        repr(results)
        for name in results.keys():  # noqa: SIM118
            if name.split("/")[0] in ("input", "model", "history", "frames"):
                results[name]
        results.history()
        for kind in ("fixed", "loading", "measured"):
            results.point_blocks(kind)
        for frame in results.frames:
            frame.polygons()
            assert len(frame.contacts) >= 0
            for name in rockdda.FIELDS:
                frame.field(name)
        if draw and results.n_frames:
            # names of this case: others are read at the same time
            results.plot("stress_min").figure.savefig(path.with_suffix(".png"), dpi=30)
            results.to_vtk(path.with_suffix(".pvd"))


def judge(good: bytes, k: int, seed: int, folder: Path) -> str:
    """Make and read a case in this process."""
    import rockdda

    path = folder / f"{k}.h5"
    spoil(good, k, seed, path)
    # a file that was changed lately is tried again for some seconds: a run might be writing it
    os.utime(path, (1e9, 1e9))
    try:
        read_all(path, k % 4 == 0)
    except rockdda.InputError:
        return REFUSED
    except BaseException:
        traceback.print_exc()
        return FAILED
    return FINE


def work(results: str, first: int, n: int, seed: int, folder: Path) -> None:
    """A process for each case: judge it, one line each."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot
    import pandas  # noqa: F401
    import rockdda
    import rockdda.export
    import rockdda.plot  # noqa: F401

    good = Path(results).read_bytes()
    for k in range(first, first + n):
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            os.dup2(os.open(folder / f"{k}.err", os.O_WRONLY | os.O_CREAT), 2)
            print(k, judge(good, k, seed, folder), flush=True)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if status != 0:
            print(k, f"{FAILED} with signal {status & 127}, exit code {status >> 8}", flush=True)


def run(
    results: Path, first: int, n: int, seed: int, jobs: int, keep: Path | None = None
) -> tuple[Counter[str], list[str]]:
    """Outcomes and faults of n cases."""
    outcomes: Counter[str] = Counter()
    wrong = []
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(jobs) as pool:
        folder = Path(name)

        def start(job: int) -> str:
            begin, end = first + n * job // jobs, first + n * (job + 1) // jobs
            command = [sys.executable, "-W", "ignore", __file__, os.fspath(results), "--work", name]
            command += ["--seed", str(seed), "--first", str(begin), "--n", str(end - begin)]
            environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
            return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=environment).stdout

        for output in pool.map(start, range(jobs)):
            for line in output.splitlines():
                k, outcome = line.split(" ", 1)
                outcomes[outcome.split()[0]] += 1
                if outcome not in (FINE, REFUSED):
                    what = spoil(results.read_bytes(), int(k), seed, folder / "again.h5")
                    error = (folder / f"{k}.err").read_text(errors="replace")[-1500:]
                    wrong.append(f"case {k} ({what}): {outcome}\n{error}")
                    if keep:
                        keep.mkdir(parents=True, exist_ok=True)
                        (keep / f"{k}.h5").write_bytes((folder / "again.h5").read_bytes())
    return outcomes, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("--n", type=int, default=2000)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path, help="a folder for the cases that fail")
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    wish = parser.parse_args()
    if wish.work:
        work(os.fspath(wish.results), wish.first, wish.n, wish.seed, wish.work)
        return 0
    outcomes, wrong = run(wish.results, wish.first, wish.n, wish.seed, wish.jobs, wish.keep)
    print("\n".join(wrong))
    print(f"{wish.n} files: {dict(sorted(outcomes.items()))}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
