# SPDX-License-Identifier: MIT
"""Blocks move in time: whole runs with results, and simulations that a script advances."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Protocol, runtime_checkable

import numpy as np

from .arrays import FloatArray, IntArray
from .errors import ConvergenceError, InputError
from .native import ENERGIES, REASON, REQUEST, RESULTS, TITLE, Session
from .notebook import NotebookBar, in_notebook
from .results import Contacts, Results
from .results import open as open_results
from .start import Stored
from .text import PathLike

__all__ = ["Progress", "Simulation", "run"]

#: Called now and then with the share that is done (0 … 1), the steps done, and the time reached.
Progress = Callable[[float, int, float], object]

# Steps are done in chunks of about this number of seconds; between them Python checks for Ctrl-C and shows progress.
CHUNK = 0.1
ALL = 2**31 - 1


@runtime_checkable
class HasInput(Protocol):
    """A model in memory, such as `rockdda.Model`."""

    def input_texts(self, stack: ExitStack) -> tuple[tuple[str, str, str], tuple[str, str, str]]:
        """Names and texts of the geometry, analysis and options file; `stack` keeps files that the run needs."""


def run(
    geometry: PathLike | HasInput, analysis: PathLike | None = None, *, output: PathLike | None = None,
    config: PathLike | None = None, steps: int | None = None, t_end: float | None = None, threads: int | None = None,
    solver: str | None = None, save_every: int | None = None, max_wall: float | None = None,
    checkpoint_every: float | None = None, dialect: str | None = None, strict: bool = False, allow_open: bool = False,
    force: bool = False, progress: Progress | bool | None = None,
) -> Results:  # fmt: skip
    """Run a model and return its results, which are those of `rockdda run`, bit for bit.

    geometry: a labelled file (.nml with &model), a folder with the files of a model, a geometry or block file (then
    with `analysis`), or a `Model`.
    output: where the results go; by default the analysis file's stem + .h5 in the current folder. A file that is
    there is overwritten only with force=True. progress: True shows a bar, a function is called as
    progress(fraction, step, time). The other arguments are the options of `rockdda run`.

    Raises InputError before anything is computed or written; ConvergenceError when the computation fails (its
    `results` hold everything up to there); OutputError. Ctrl-C (KeyboardInterrupt) stops after the step at hand; the
    results so far are kept. With max_wall the results are incomplete: see `results.complete`; the step at
    hand is dropped. With strict=True energy from nowhere, or a static stage that ends without
    equilibrium, raises ConvergenceError; otherwise it is a warning."""
    given = dict(locals())
    session = Session()
    session.request(**{name: given[name] for name in REQUEST})
    started = clock.monotonic()
    with ExitStack() as stack:
        _read(session, geometry, analysis, config, stack)
        report = _reporter(progress, stack, session.text(TITLE))
        session.warn()
        session("start", True)
        # absolute, because the caller may change the folder before reading the results
        path = os.path.abspath(session.text(RESULTS))  # noqa: PTH100
        deadline = started + max_wall if max_wall is not None else float("inf")
        try:
            finished = False
            while not finished:
                _, finished = session.advance(ALL, max(0.0, min(CHUNK, deadline - clock.monotonic())))
                facts, sizes = session.facts(), session.sizes()
                if report is not None:
                    report(facts["fraction"], sizes["step"], facts["time"])
                if not finished and clock.monotonic() >= deadline:
                    break
            session("finish", "max-wall")
        except ConvergenceError as error:
            error.results = open_results(path)
            raise
        except KeyboardInterrupt:
            session("finish", "signal SIGINT")
            step = session.sizes()["step"]
            raise KeyboardInterrupt(f"stopped after step {step}; the results so far are in {path}") from None
        except BaseException as error:
            session("finish", f"stopped by {type(error).__name__}")
            raise
    session.warn()
    session.free()
    return open_results(path)


class Simulation:
    """A model that is advanced step by step.

    >>> import rockdda
    >>> with rockdda.Simulation("inputs/flat_arch") as simulation:  # doctest: +SKIP
    ...     while simulation.advance(10):
    ...         print(simulation.time, simulation.velocity[:, 1].min())

    Arrays are those after the last step; they cannot be changed, and do not change when the simulation advances.
    Takes the arguments of `run`; results are written only when `output` is given, and are closed by `close`, at the
    end of a `with` block, or when the computation fails."""

    vertices = Stored[FloatArray]("vertices")
    """(nv, 2) [length]"""
    centroid = Stored[FloatArray]("centroid")
    """(nb, 2) [length]"""
    rotation = Stored[FloatArray]("rotation")
    """(nb,) since the start, counter-clockwise [rad]"""
    stress = Stored[FloatArray]("stress")
    """(nb, 3) σx σy τxy, tension positive [force/length²]"""
    velocity = Stored[FloatArray]("velocity")
    """(nb, 6) u0 v0 r0 εx εy γxy of the centroid, per time"""
    area = Stored[FloatArray]("area")
    """(nb,) [length²]"""

    def __init__(
        self, geometry: PathLike | HasInput, analysis: PathLike | None = None, *, output: PathLike | None = None,
        config: PathLike | None = None, steps: int | None = None, t_end: float | None = None,
        threads: int | None = None, solver: str | None = None, save_every: int | None = None,
        checkpoint_every: float | None = None, dialect: str | None = None, strict: bool = False,
        allow_open: bool = False, force: bool = False,
    ) -> None:  # fmt: skip
        given = dict(locals())
        self._session = Session()
        self._session.request(**{name: given[name] for name in REQUEST if name in given})
        with ExitStack() as stack:
            _read(self._session, geometry, analysis, config, stack)
        self._session.warn()
        self._session("start", output is not None)
        #: where the results go, or None
        self.output: str | None = os.path.abspath(self._session.text(RESULTS)) if output is not None else None  # noqa: PTH100
        sizes = self._session.sizes()
        self._sizes = sizes
        offset, vertices, joint, material = self._session.array("blocks", sizes["blocks"], sizes["vertices"])
        #: (nb+1,) block i owns the vertices [offset[i], offset[i+1])
        self.vertex_offset: IntArray = offset
        #: (nv,) joint material of the edge that starts at the vertex; 0: a bridge to an island
        self.edge_joint: IntArray = joint
        #: (nb,) material number, from 1
        self.block_material: IntArray = material
        self._start_vertices: FloatArray = vertices
        self._finished = sizes["steps"] == 0
        self._state: dict[str, FloatArray] = {}
        self._contacts: Contacts | None = None

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.close(f"stopped by {kind.__name__}")

    def __repr__(self) -> str:
        return f"<rockdda.Simulation: {self.n_blocks} blocks, step {self.step}, time {self.time:g}>"

    def advance(self, steps: int = 1) -> int:
        """Do the given number of steps, or those that are left; returns how many were done.

        Ctrl-C stops after the step at hand. Raises ConvergenceError when the computation fails; the state is
        then that of the last step."""
        done = 0
        self._state, self._contacts = {}, None
        try:
            while done < steps and not self._finished:
                some, self._finished = self._session.advance(steps - done, CHUNK)
                done += some
        except ConvergenceError as error:
            if self.output is not None:
                error.results = open_results(self.output)
            raise
        finally:
            self._sizes = self._session.sizes()
        return done

    def close(self, reason: str = "closed") -> None:
        """Close the results, if some are written. The state can still be looked at."""
        self._session("finish", reason)

    def results(self) -> Results:
        """The results that are being written (the last two seconds may be missing until `close`)."""
        if self.output is None:
            raise InputError("this simulation writes no results: give it an output")
        return open_results(self.output)

    @property
    def finished(self) -> bool:
        """Is the last step or the end time reached?"""
        return self._finished

    @property
    def exit_reason(self) -> str:
        return self._session.text(REASON)

    @property
    def n_blocks(self) -> int:
        return self._sizes["blocks"]

    @property
    def step(self) -> int:
        """Accepted steps so far."""
        return self._sizes["step"]

    @property
    def time(self) -> float:
        return self._session.facts()["time"]

    @property
    def dt(self) -> float:
        """Length of the last step."""
        return self._session.facts()["dt"]

    @property
    def energy(self) -> dict[str, float]:
        """The energy ledger after the last step, by the names of `history/energy`."""
        facts = self._session.facts()
        return {name: facts[name] for name in self._session.text(ENERGIES).split()}

    def _stored(self, name: str, _: object = None) -> FloatArray:
        if not self._state:
            names = ["vertices", "centroid", "rotation", "stress", "velocity", "area"]
            arrays = self._session.array("state", self._sizes["blocks"], self._sizes["vertices"])
            self._state = dict(zip(names, arrays, strict=True))
        return self._state[name]

    @property
    def displacement(self) -> FloatArray:
        """(nv, 2) of the vertices since the start [length]"""
        return self.vertices - self._start_vertices

    @property
    def contacts(self) -> Contacts:
        """The contacts of the last step."""
        if self._contacts is None:
            self._contacts = Contacts(*self._session.array("contacts", self._sizes["contacts"]))
        return self._contacts

    def polygons(self) -> list[FloatArray]:
        """For each block an (m, 2) array of its vertices, counter-clockwise, not closed [length]."""
        return np.split(self.vertices, self.vertex_offset[1:-1])


def _read(
    session: Session, geometry: PathLike | HasInput, analysis: PathLike | None, config: PathLike | None,
    stack: ExitStack,
) -> None:  # fmt: skip
    """Read a model from files or from memory."""
    if isinstance(geometry, HasInput):
        if analysis is not None or config is not None:
            raise InputError("a Model brings its own analysis and options")
        names, texts = geometry.input_texts(stack)
        session("read_texts", *names, *texts)
        return
    labelled = os.fspath(geometry).lower().endswith(".nml")
    if analysis is None and not labelled and not os.path.isdir(geometry):  # noqa: PTH112
        exists = os.path.exists(geometry)  # noqa: PTH110
        raise InputError("is a file: an analysis file is needed, too" if exists else "no such folder", geometry)
    session("read_files", geometry, analysis, config)


def _reporter(progress: Progress | bool | None, stack: ExitStack, title: str) -> Progress | None:
    """A function that shows progress."""
    if progress is None or progress is False:
        return None
    if progress is not True:
        return progress
    if in_notebook():
        return NotebookBar(title or "run").show
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns: list[Any] = [TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()]
    columns.append(TextColumn("{task.fields[where]}"))
    bar = stack.enter_context(Bar(*columns))
    task = bar.add_task(title or "run", total=1.0, where="")

    def show(fraction: float, step: int, time: float) -> None:
        bar.update(task, completed=fraction, where=f"step {step}, time {time:g}")

    return show
