# SPDX-License-Identifier: MIT
"""Checkpoints that were changed and signed again: the digest fits, and the values make no sense.

    .venv/bin/python tests/fuzz/checkpoints.py PROGRAM [--n 2000] [--seed 1] [--jobs 2] [--keep FOLDER]

Each checkpoint is given to `rockdda resume`, some to `rockdda info`. One fails when the program crashes, is caught by a
sanitizer, takes more than 30 s, speaks of an internal error, leaves with another exit code than 0 (the change did not
matter), 2 (refused), 3 (no solution) or 4 (time limit), or touches a file that is none of its own. Case k of a seed is
the same on every machine.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np

SEAL = 124  # bytes of the last line, of which the last 65 are the digest and a line end
INPUTS = Path(__file__).parents[2] / "inputs"
MODELS = ("released_block", "island", "bolted_beam", "stack")
INTEGERS = (0, -1, 1, 2, 3, 7, 100, 10**5, 10**9, 2**31 - 1, -(2**31))
REALS = (
    *(0.0, -0.0, -1.0, 1.0, 0.5, 1e-9, 1e-300, -1e-300, 5e-324, 1e9, 1e15, -1e15, 1e60, -1e60, 1e300, -1e300),
    *(1.7e308, -1.7e308, float("nan"), float("inf"), float("-inf")),
)
TEXTS = ("", "x", "../../victim", "/victim.txt", "a" * 100000, "\x1b[2J", "pcg", "dense", "sor", "%s%n", "1")
VICTIM = b"a file of the user\n"


def sign(path: Path) -> None:
    """Give a changed checkpoint the digest that fits. The old last line is still behind it, or HDF5 has cut it off."""
    data = path.read_bytes()
    place = data.rfind(b"rockdda checkpoint, SHA-256")
    head = data if place < 0 else data[:place]
    line = b"rockdda checkpoint, SHA-256 of all bytes before this line: "
    path.write_bytes(head + line + hashlib.sha256(head).hexdigest().encode() + b"\n")


def unsign(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-SEAL])


def datasets(file: h5py.File) -> list[str]:
    names: list[str] = []
    file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    return sorted(names)


def is_text(item: h5py.Dataset) -> bool:
    return h5py.check_string_dtype(item.dtype) is not None


def replace(file: h5py.File, name: str, values) -> None:
    del file[name]
    file[name] = values


def index_lines(file: h5py.File) -> list[str]:
    """The small values: name, kind and shape of each."""
    text = file["small/index"][()]
    return text.decode().splitlines() if isinstance(text, bytes) else []


def place(file: h5py.File, name: str) -> tuple[str, int, tuple[int, ...]]:
    """Where a small value is: the dataset, the numbers or letters before it, and its shape; KeyError for another."""
    before = {"real": 0, "integer": 0, "text": 0}
    for line in index_lines(file):
        found, kind, *numbers = line.split()
        shape = tuple(int(n) for n in reversed(numbers))
        if found == name:
            return "small/" + {"real": "reals", "integer": "integers", "text": "texts"}[kind], before[kind], shape
        before[kind] += int(np.prod(shape))
    raise KeyError(name)


def value(file: h5py.File, name: str):
    """A value of a checkpoint, small or not."""
    if name in file:
        return file[name][()]
    path, start, shape = place(file, name)
    found = file[path][()][start : start + int(np.prod(shape))]
    return found if isinstance(found, bytes) else found.reshape(shape)


def remove_small(file: h5py.File, name: str) -> None:
    """Take a value out of the small ones: its line, and its numbers or letters."""
    path, start, shape = place(file, name)
    kept = file[path][()]
    head, tail = kept[:start], kept[start + int(np.prod(shape)) :]
    replace(file, path, head + tail if isinstance(kept, bytes) else np.concatenate([head, tail]))
    lines = [line for line in index_lines(file) if line.split()[0] != name]
    replace(file, "small/index", "".join(line + "\n" for line in lines))


def put(file: h5py.File, name: str, values) -> None:
    """Give a value, small or not, as a dataset."""
    if name in file:
        del file[name]
    else:
        remove_small(file, name)
    file[name] = values


def extreme(random_: random.Random, dtype: np.dtype):
    return random_.choice(INTEGERS) if dtype.kind == "i" else random_.choice(REALS)


def change_values(file: h5py.File, random_: random.Random, whole: bool) -> str:
    names = [name for name in datasets(file) if not is_text(file[name]) and file[name].size > 0]
    if not whole:
        # most values are among the small ones, unless these were exchanged with a text
        names += [name for name in ("small/reals", "small/integers") if name in names] * len(names)
    name = random_.choice(names)
    values = file[name][()]
    value = extreme(random_, values.dtype)
    index = slice(None) if whole else random_.randrange(values.size)
    values.reshape(-1)[index] = value
    file[name][...] = values
    return f"{name}[{'all' if whole else index}] = {value}"


def change_text(file: h5py.File, random_: random.Random) -> str:
    name = random_.choice([name for name in datasets(file) if is_text(file[name])])
    text = random_.choice(TEXTS)
    replace(file, name, text)
    return f"{name} = {text[:20]!r}"


def change_small(file: h5py.File, random_: random.Random) -> str:
    """A small value that is missing, or one with another shape and values, as a dataset."""
    name = random_.choice(index_lines(file)).split()[0]
    if random_.random() < 0.3:
        remove_small(file, name)
        return f"without {name}"
    values = random_.choice(
        (3, 2.5, np.zeros(2), np.arange(3), np.ones((2, 2)), np.zeros(0), "x", np.zeros((1, 2, 3)), -1, np.nan)
    )
    put(file, name, values)
    return f"{name} = {values!r}"


def change_index(file: h5py.File, random_: random.Random) -> str:
    """Names of small values exchanged, a line that is missing, twice there, or says something else."""
    lines = index_lines(file)
    k, other = random_.randrange(len(lines)), random_.randrange(len(lines))
    name, kind, *shape = lines[k].split()
    kind_of_change = random_.choice(("names", "missing", "twice", "kind", "shape", "junk", "order"))
    if kind_of_change == "names":
        found, *rest = lines[other].split()
        lines[k], lines[other] = " ".join([found, kind, *shape]), " ".join([name, *rest])
    elif kind_of_change == "missing":
        del lines[k]
    elif kind_of_change == "twice":
        lines.insert(other, lines[k])
    elif kind_of_change == "kind":
        lines[k] = " ".join([name, random_.choice(("real", "integer", "text", "none")), *shape])
    elif kind_of_change == "shape":
        lines[k] = " ".join([name, kind, *map(str, random_.choices(INTEGERS, k=random_.randrange(4)))])
    elif kind_of_change == "junk":
        lines[k] = random_.choice(TEXTS)
    else:
        lines[k], lines[other] = lines[other], lines[k]
    replace(file, "small/index", "".join(line + "\n" for line in lines))
    return f"index: {kind_of_change} {k}"


def drop(file: h5py.File, random_: random.Random) -> str:
    name = random_.choice(datasets(file) * 4 + sorted(file))
    del file[name]
    return f"without {name}"


def reshape(file: h5py.File, random_: random.Random) -> str:
    name = random_.choice([name for name in datasets(file) if not is_text(file[name])])
    values = np.atleast_1d(file[name][()])
    kinds = {
        "cut": lambda v: v[: random_.randrange(len(v) + 1)],
        "twice": lambda v: np.concatenate([v, v]),
        "empty": lambda v: v[:0],
        "flat": lambda v: v.reshape(-1),
        "deep": lambda v: v.reshape((1, *v.shape)),
        "turned": lambda v: v.T.copy(),
        "scalar": lambda v: v.reshape(-1)[0] if v.size else v,
        "long": lambda v: np.resize(v, (100000, *v.shape[1:])) if v.size else v,
    }
    kind = random_.choice(sorted(kinds))
    replace(file, name, kinds[kind](values))
    return f"{name} {kind}"


def retype(file: h5py.File, random_: random.Random) -> str:
    name = random_.choice(datasets(file))
    values = file[name][()]
    kind = random_.choice(("f4", "f8", "i1", "i8", "u4", "i4", ">i4", "S8", "text", "compound", "bool"))
    if is_text(file[name]):
        values = 3.0
    if kind == "text":
        replace(file, name, str(values))
    elif kind == "compound":
        replace(file, name, np.zeros(np.shape(values), dtype=[("a", "f8"), ("b", "i4")]))
    else:
        with np.errstate(all="ignore"):
            replace(file, name, np.asarray(values).astype(kind))
    return f"{name} as {kind}"


def change_attribute(file: h5py.File, random_: random.Random) -> str:
    owner = random_.choice(["/", "/", "/", "input/geometry", "state", "model/vertices"])
    if owner not in file:
        owner = "/"
    attributes = file[owner].attrs
    name = random_.choice([*attributes, "new"])
    value = random_.choice([0, -1, 2**31 - 1, 1.5, "x", "rockdda", np.arange(1000), np.float64("nan"), ["a", "b"]])
    if random_.random() < 0.3 and name in attributes:
        del attributes[name]
        return f"without {owner}@{name}"
    attributes[name] = value
    return f"{owner}@{name} = {str(value)[:20]}"


def exchange(file: h5py.File, random_: random.Random) -> str:
    one, other = random_.sample(datasets(file), 2)
    file.move(one, "aside")
    file.move(other, one)
    file.move("aside", other)
    return f"{one} <-> {other}"


def lead_out(file: h5py.File, random_: random.Random) -> str:
    name = random_.choice(datasets(file))
    kind = random_.choice(("soft", "external", "hard", "storage", "cycle", "named type"))
    if kind == "soft":
        replace(file, name, h5py.SoftLink("/model/vertices"))
    elif kind == "external":
        replace(file, name, h5py.ExternalLink("victim.txt", "/x"))
    elif kind == "hard":
        file["state/again"] = file[name]
    elif kind == "cycle":
        file["state/again"] = file["state"]
    elif kind == "named type":
        file["state/again"] = np.dtype("f8")
    else:
        shape = file[name].shape
        del file[name]
        file.create_dataset(name, shape=shape, dtype="f8", external=[("victim.txt", 0, h5py.h5f.UNLIMITED)])
    return f"{name}: {kind}"


CHANGES = (
    *[lambda file, random_: change_values(file, random_, False)] * 8,
    *[lambda file, random_: change_values(file, random_, True)] * 3,
    *[reshape] * 3,
    *[retype] * 2,
    *[drop] * 2,
    *[change_small] * 3,
    *[change_index] * 2,
    change_text,
    change_attribute,
    exchange,
    lead_out,
)


class Fuzzer:
    """Good checkpoints of some models, and a folder for the spoiled ones."""

    def __init__(self, program: str, folder: Path, seed: int, models=MODELS) -> None:
        self.program, self.folder, self.seed, self.models = program, folder, seed, models
        for model in models:
            command = [program, "run", os.fspath(INPUTS / model), "-o", f"{model}.h5", "--steps", "6", "--quiet"]
            subprocess.run([*command, "--force"], cwd=folder, check=True, stdout=subprocess.DEVNULL, timeout=300)

    def spoil(self, k: int, folder: Path) -> str:
        """Make case k in a folder: o.h5, o.ckpt.h5 and a file that nobody may touch; what was changed."""
        random_ = random.Random(f"{self.seed} {k}")
        model = random_.choice(self.models)
        for ending in (".h5", ".ckpt.h5"):
            shutil.copy(self.folder / (model + ending), folder / ("o" + ending))
        (folder / "victim.txt").write_bytes(VICTIM)
        path = folder / "o.ckpt.h5"
        unsign(path)
        done = []
        with h5py.File(path, "r+") as file:
            for _ in range(random_.choice((1, 1, 1, 2, 3))):
                try:
                    done.append(random_.choice(CHANGES)(file, random_))
                except (KeyError, ValueError, TypeError, OSError, OverflowError, RuntimeError, IndexError):
                    continue  # nothing to change in what an earlier change has left
        sign(path)
        return f"{model}: {'; '.join(done)}"

    def try_one(self, k: int, keep: Path | None = None) -> tuple[int, str]:
        """Exit code of `resume`, and what is wrong with it ('' as a rule)."""
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        try:
            what = self.spoil(k, folder)
            code, wrong = self.call(folder, "resume", "o.ckpt.h5", "--steps", "2", "--max-wall", "10")
            if not wrong and k % 4 == 0:
                self.spoil(k, folder)
                _, wrong = self.call(folder, "info", "o.ckpt.h5")
            if wrong and keep:
                shutil.copytree(folder, keep / str(k), dirs_exist_ok=True)
            return code, f"case {k}, {what}: {wrong}" if wrong else ""
        finally:
            shutil.rmtree(folder)

    def call(self, folder: Path, command: str, *arguments: str) -> tuple[int, str]:
        threads = ["--threads", "1"] if command == "resume" else []
        environment = {
            **os.environ,
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            # what is found in the child that tries a file first would be lost
            "ASAN_OPTIONS": f"detect_leaks=0:log_path={folder}/sanitizer",
            "UBSAN_OPTIONS": f"print_stacktrace=1:log_path={folder}/sanitizer",
        }
        try:
            process = subprocess.run(
                [self.program, command, *arguments, *threads, "--quiet"],
                cwd=folder,
                env=environment,
                capture_output=True,
                timeout=30,
            )
        except subprocess.TimeoutExpired:
            return -1, "did not end"
        message = process.stderr.decode(errors="replace")
        found = sorted(folder.glob("sanitizer*"))
        if found:
            return process.returncode, "sanitizer: " + found[0].read_text(errors="replace")[:3000]
        if process.returncode not in (0, 2, 3, 4) or "internal error" in message or "untime error" in message:
            return process.returncode, f"exit code {process.returncode}: {message.strip()[:1000]}"
        victim = folder / "victim.txt"
        if victim.exists() and victim.read_bytes() != VICTIM:
            return process.returncode, "wrote to another file"
        return process.returncode, ""


def run(fuzzer: Fuzzer, first: int, n: int, jobs: int, keep: Path | None = None) -> tuple[Counter[int], list[str]]:
    """Exit codes and faults of n cases."""
    codes: Counter[int] = Counter()
    wrong = []
    with ThreadPoolExecutor(jobs) as pool:
        for code, fault in pool.map(lambda k: fuzzer.try_one(k, keep), range(first, first + n)):
            codes[code] += 1
            if fault:
                wrong.append(fault)
                print(fault, flush=True)
    return codes, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--n", type=int, default=2000)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--keep", type=Path, help="a folder for the cases that fail")
    wish = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        fuzzer = Fuzzer(os.fspath(Path(wish.program).resolve()), Path(folder), wish.seed)
        codes, wrong = run(fuzzer, wish.first, wish.n, wish.jobs, wish.keep)
    print(f"{wish.n} checkpoints: exit codes {dict(sorted(codes.items()))}, {len(wrong)} failed")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
