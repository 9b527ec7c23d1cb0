# SPDX-License-Identifier: MIT
"""Runs that are hit by faults, and what they must be worth afterwards: for the tests and for scripts/torture."""

import os
import shutil
import signal
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

MODELS = Path(__file__).parents[2] / "inputs"
#: Attributes that may differ between a run that stopped and one that did not.
MAY_DIFFER = ("created", "exit_reason")


#: A folder in memory, where waiting for the disk costs nothing.
MEMORY = next((path for path in ("/dev/shm",) if os.access(path, os.W_OK)), None)


def new_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="rockdda-", dir=MEMORY))


def shipped_models() -> list[Path]:
    return sorted(path.parent for path in MODELS.glob("*/*.df"))


def objects(file: h5py.File) -> list[str]:
    names: list[str] = []
    file.visit(names.append)
    return sorted(names)


def bits(values: object) -> bytes:
    if isinstance(values, bytes):
        return values
    array = np.asarray(values)
    return b"\0".join(array.ravel()) if array.dtype == object else array.tobytes()  # texts


def differences(one: Path, other: Path) -> list[str]:
    """What differs between two results, bit by bit: every dataset, every attribute."""
    found = []
    with h5py.File(one, "r") as a, h5py.File(other, "r") as b:
        if objects(a) != objects(b):
            return ["names of objects"]
        for name in ["/", *objects(a)]:
            x, y = a[name], b[name]
            if isinstance(x, h5py.Dataset) and (x.shape != y.shape or x.dtype != y.dtype or bits(x[()]) != bits(y[()])):
                found.append(f"{name} {x.shape} {y.shape}")
            if set(x.attrs) != set(y.attrs):
                found.append(f"attributes of {name}")
                continue
            for key in x.attrs:
                if key not in MAY_DIFFER and not np.array_equal(x.attrs[key], y.attrs[key]):
                    found.append(f"attribute {key} of {name}")
    return found


def lost_rows(broken: Path, whole: Path) -> list[str]:
    """What a reader finds wrong in the results of a run that came to a sudden end: every row that is there has to be
    that of the whole run."""
    found = []
    with h5py.File(broken, "r", locking=False) as a, h5py.File(whole, "r") as b:
        for group in ("history", "frames"):
            for name, table in a[group].items() if group in a else ():
                rows = min(len(table), len(b[group][name]))
                # the last frame of a run that stopped in order may be none of the whole run
                if group == "frames" and rows > 0 and a.attrs.get("exit_reason", "running") != "running":
                    continue
                if bits(table[:rows]) != bits(b[group][name][:rows]) or len(table) > len(b[group][name]):
                    found.append(f"{group}/{name}")
    return found


@dataclass
class Case:
    """A run of some steps, and its results when nothing disturbs it."""

    program: str
    arguments: list[str]
    steps: int
    solver: str = ""
    folder: Path = field(default_factory=new_folder)

    def __post_init__(self) -> None:
        self.whole = self.folder / "whole.h5"
        outcome = self.run("run", output="whole.h5")
        if outcome.returncode != 0:
            raise RuntimeError(outcome.stderr.decode())

    def command(
        self, what: str, output: str = "out.h5", steps: int | None = None, more: tuple[str, ...] = ()
    ) -> list[str]:
        if what == "resume":
            return [self.program, "resume", output.replace(".h5", ".ckpt.h5"), "--quiet", *more]
        steps = self.steps if steps is None else steps
        solver = ["--solver", self.solver] if self.solver else []
        options = ["-o", output, "--steps", str(steps), "--save-every", "4", *solver, "--quiet", "--force", *more]
        return [self.program, "run", *self.arguments, *options]

    def run(self, what: str, output: str = "out.h5", steps: int | None = None, more: tuple[str, ...] = (), **options):
        options.setdefault("timeout", 300)
        command = self.command(what, output, steps, more)
        return subprocess.run(command, cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, **options)

    def run_and_kill(self, what: str, delay: float, more: tuple[str, ...] = ()) -> bool:
        """SIGKILL after some seconds; true when it hit."""
        process = subprocess.Popen(
            self.command(what, more=more), cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            process.wait(delay)
        except subprocess.TimeoutExpired:
            process.kill()
        return process.wait() == -signal.SIGKILL

    def clear(self) -> None:
        for path in self.folder.glob("out.*"):
            path.unlink()

    def recover(self) -> str:
        """Go on after a fault as a job script does: resume when there is a checkpoint, else begin again. What is wrong
        in the end, nothing when all is well."""
        results, checkpoint = self.folder / "out.h5", self.folder / "out.ckpt.h5"
        wrong = []
        if checkpoint.exists():
            # from the first checkpoint on results are there and can be read
            try:
                wrong = lost_rows(results, self.whole)
            except OSError as problem:
                wrong = [f"results cannot be read: {problem}"]
            outcome = self.run("resume")
        else:
            outcome = self.run("run")
        if outcome.returncode != 0:
            wrong.append(f"exit code {outcome.returncode}: {outcome.stderr.decode().strip()}")
        else:
            wrong += differences(results, self.whole)
            wrong += [f"left behind: {path.name}" for path in self.folder.glob("out.*.undo")]
            wrong += [f"left behind: {path.name}" for path in self.folder.glob("out.*.part")]
        return "; ".join(wrong)

    def remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)


def preloaded(folder: Path, name: str) -> Path:
    """A library to be preloaded, made in this folder."""
    library = folder / f"{name}.so"
    source = Path(__file__).with_name(f"{name}.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, source], check=True, capture_output=True)
    return library


@dataclass
class LibraryFaults:
    """The preloaded library of library_fault.c."""

    folder: Path

    def __post_init__(self) -> None:
        self.library = preloaded(self.folder, "library_fault")

    def environment(self, function: str, at: int, status: int = 0) -> dict[str, str]:
        return {
            **os.environ,
            "LD_PRELOAD": os.fspath(self.library),
            "FAULT_FUNCTION": function,
            "FAULT_AT": str(at),
            "FAULT_STATUS": str(status),
            "FAULT_COUNT": os.fspath(self.folder / "calls"),
        }

    def calls(self) -> int:
        """Of the function, in the program that ended last."""
        return int((self.folder / "calls").read_text())


@dataclass
class Faults:
    """Files that fail: the preloaded library of fault.c."""

    folder: Path

    def __post_init__(self) -> None:
        self.library = preloaded(self.folder, "fault")

    def environment(self, at: int, kind: str) -> dict[str, str]:
        return {
            **os.environ,
            "LD_PRELOAD": os.fspath(self.library),
            "FAULT_AT": str(at),
            "FAULT_KIND": kind,
            "FAULT_COUNT": os.fspath(self.folder / "calls"),
        }

    def count(self, case: Case, what: str, more: tuple[str, ...] = ()) -> int:
        """Calls that change files, in a run that is not disturbed."""
        outcome = case.run(what, more=more, env=self.environment(-1, "kill"))
        if outcome.returncode != 0:
            raise RuntimeError(outcome.stderr.decode())
        return int((self.folder / "calls").read_text())


@dataclass
class Refusals:
    """Memory that is refused: the preloaded library of refuse.c."""

    folder: Path

    def __post_init__(self) -> None:
        self.library = preloaded(self.folder, "refuse")

    def environment(self, at: int) -> dict[str, str]:
        """No memory from request number `at` on; 0: there is always some."""
        return {
            **os.environ,
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "LD_PRELOAD": os.fspath(self.library),
            "REFUSE_AT": str(at),
            "REFUSE_COUNT": os.fspath(self.folder / "requests"),
        }

    def count(self) -> int:
        """Requests of the last process that ended in order."""
        return int((self.folder / "requests").read_text())
