# SPDX-License-Identifier: MIT
"""Results files, read lazily.

Numbers are in the units of the input (`Results.units`), stresses are positive in tension. Arrays are indexed from 0,
frame 0 is the start; numbers that are labels (materials, columns of tables, messages) count from 1, as in the input
files.
"""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

import h5py
import numpy as np

from .arrays import AnyArray, FloatArray, IntArray
from .columns import Columns
from .errors import InputError
from .frames import CONTACT_TABLES, FIELDS, JOINT_TABLES, STRENGTH_TABLE, Contacts, Field, Frame, Frames
from .joints import joint_points
from .notebook import card, drawing_of_blocks
from .outputs import output as draw_or_write
from .stages import STAGE_TABLES, Stage, StageTables
from .storage.check import attributes_problem, results_problem, rows_problem
from .storage.file import GrowingFile, NoSuchPath, check_format, check_signature, plain
from .storage.tables import names_in
from .text import PathLike, readable

if TYPE_CHECKING:
    import geopandas
    import matplotlib.axes
    import pandas
    import xarray

__all__ = ["FIELDS", "Contacts", "Field", "Frame", "Frames", "Results", "Stage", "open"]

T = TypeVar("T")

#: The tables that grow with the run; `contact_offset` has one row more than there are frames.
HISTORY_TABLES = names_in("history", "")
FRAME_TABLES = [
    name for name in names_in("frames", "", "stages", "bolts", "nodes", "liners") if not name.startswith("contact_")
]


class Results(StageTables):
    """A results file. Make it with `rockdda.open(path)` or `rockdda.run(...)`.

    Only the sizes are read at first, arrays when they are used. While the run still writes the file, the object shows
    the steps and frames that were there when it was opened or last refreshed; `refresh` adds what was written since."""

    def __init__(self, path: PathLike) -> None:
        self.path = Path(path)
        self._source = GrowingFile(self.path)
        self._cache: dict[str, AnyArray] = {}
        self._attributes: dict[str, Any] = {}
        self._run: tuple[Any, int] | None = None
        self.n_steps = self.n_frames = 0
        self._last_frame = -1  # its step
        self.has_joints = False
        check_signature(self.path)
        self._read_sizes()

    # -- the file ------------------------------------------------------------------------------------------------

    def refresh(self) -> bool:
        """Add what a running job has written since; True when there are more steps or frames, or it has ended."""
        before = (self.n_steps, self.n_frames, self.complete, self.exit_reason)
        self._read_sizes()
        return before != (self.n_steps, self.n_frames, self.complete, self.exit_reason)

    def close(self) -> None:
        """Close the file. Reading afterwards is an error."""
        self._source.close()
        self._cache.clear()

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "complete" if self.complete else self.exit_reason
        return (
            f"<rockdda.Results {str(self.path)!r}: {self.n_blocks} blocks, {self.n_frames} frames, "
            f"{self.n_steps} steps, {state}>"
        )

    @property
    def units(self) -> str:
        """The system of units of all numbers: 'SI', 'kN', 'mm' or 'none' (any consistent ones; also of older files)."""
        return str(self._attributes.get("units", "none"))

    def units_of(self, path: str) -> str:
        """The unit of a dataset, 'Pa', or its dimension where the units are not known; '' in older files."""
        return str(plain(self._source.use(lambda file: file[path].attrs.get("units", ""))))

    def _repr_html_(self) -> str:
        """What a notebook shows: facts, and the blocks of the last frame."""
        state = "complete" if self.complete else self.exit_reason
        largest = drawing = ""
        if self.n_frames:
            now = self.frames[-1]
            moved = np.hypot(*now.displacement.T)[now.active]
            unit = self.units_of("model/vertices") if self.units != "none" else ""
            largest = " ".join([f"{float(moved.max(initial=0.0)):.4g}", unit, "(last frame)"]) if len(moved) else ""
            largest = largest.replace("  ", " ")
            drawing = drawing_of_blocks(now.vertices, self.vertex_offset, now.active)
        stages = " → ".join(stage.name for stage in self.stages) if self.has_stages else ""
        facts = [("file", self.path), ("state", state), ("blocks", self.n_blocks), ("steps", self.n_steps)]
        facts += [("frames", self.n_frames), ("stages", stages), ("largest displacement", largest)]
        return card(self.title or self.name, [*facts, ("program", self.program_version)], drawing)

    def _read_sizes(self) -> None:
        self._source.forget()

        def read(file: h5py.File) -> tuple[dict[str, Any], int, int, int, int, int]:
            attributes = {name: plain(value) for name, value in file.attrs.items()}
            check_format(self.path, attributes)
            if problem := attributes_problem(attributes) or results_problem(file):
                raise ValueError(problem)
            names = [*names_in("history", "", "stages"), "boundary_force"]  # older files do not have all
            steps = min(file[path].shape[0] for name in names if (path := f"history/{name}") in file)
            frames = min(file[path].shape[0] for name in FRAME_TABLES if (path := f"frames/{name}") in file)
            offsets = file["frames/contact_offset"]
            frames = min(frames, offsets.shape[0] - 1)
            self.has_joints = all(f"frames/{name}" in file for name in JOINT_TABLES)
            self.has_strength = self.has_joints and f"frames/{STRENGTH_TABLE}" in file
            of_contacts = CONTACT_TABLES + (JOINT_TABLES if self.has_joints else [])
            of_contacts = of_contacts + ([STRENGTH_TABLE] if self.has_strength else [])
            rows = min(file[f"frames/{name}"].shape[0] for name in of_contacts)
            if frames > 0 and offsets[frames] > rows:  # killed in the midst of a flush
                frames = int(np.searchsorted(offsets[: frames + 1], rows, side="right")) - 1
            # a reader may come while the last rows are written: no frame without its history
            last = int(file["history/step"][steps - 1]) if steps > 0 else 0
            kept = file["frames/step"][:frames]
            frames = int(np.searchsorted(kept, last, side="right"))
            last = int(kept[frames - 1]) if frames > 0 else -1
            return attributes, steps, frames, last, file["model/block_area"].shape[0], file["model/vertices"].shape[0]

        attributes, self.n_steps, self.n_frames, self._last_frame, self.n_blocks, self.n_vertices = self._source.use(
            read
        )
        self._source.complete = bool(attributes.get("complete", 0))
        run = (attributes.get("created"), self._source.inode)
        if run != self._run:  # the file of another run has taken the place of the older one
            self._cache.clear()
        self._run, self._attributes = run, attributes

    # -- description ----------------------------------------------------------------------------------------------

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the file."""
        return dict(self._attributes)

    @property
    def title(self) -> str:
        """The title of the run, readable in any encoding."""
        return readable(str(self._attributes.get("title", "")))

    @property
    def name(self) -> str:
        """The file name without folder and ending, readable in any encoding."""
        return readable(self.path.stem)

    @property
    def created(self) -> str:
        """When the run began, in UTC (ISO 8601)."""
        return str(self._attributes.get("created", ""))

    @property
    def program_version(self) -> str:
        return str(self._attributes.get("program_version", ""))

    @property
    def complete(self) -> bool:
        """Did the run come to its end?"""
        return bool(self._attributes.get("complete", 0))

    @property
    def exit_reason(self) -> str:
        """'finished', 'running' (still, or the run was killed), or why it stopped."""
        return str(self._attributes.get("exit_reason", ""))

    # -- arrays --------------------------------------------------------------------------------------------------

    def __getitem__(self, path: str) -> Any:
        """The array at a path of the file, as NumPy array (texts as `str`); see docs/file-formats.md for all paths.

        Tables that grow are cut to the whole steps and frames of this view."""
        path = path.strip("/")

        def read(file: h5py.File) -> Any:
            if path not in file:
                raise NoSuchPath(path)
            item = file[path]
            if not isinstance(item, h5py.Dataset):
                raise NoSuchPath(path)
            if not h5py.check_string_dtype(item.dtype):
                return item[()]
            return item.asstr()[()] if item.shape else plain(item[()])

        try:
            rows = self._rows(path)
            return self._source.use(read) if rows is None else self._table(path, 0, rows)
        except NoSuchPath:
            raise self._no_such_array(path) from None

    def __contains__(self, path: object) -> bool:
        return isinstance(path, str) and path.strip("/") in self.keys()

    def keys(self) -> list[str]:
        """Paths of all arrays in the file."""

        def read(file: h5py.File) -> list[str]:
            names: list[str] = []
            file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
            return names

        return self._source.use(read)

    def rows(self, path: str, start: int, stop: int) -> AnyArray:
        """Rows [start, stop) of an array, without reading the others."""
        path = path.strip("/")
        try:
            return self._table(path, start, stop)
        except NoSuchPath:
            raise self._no_such_array(path) from None

    def block_rows(self, name: str, block: int) -> AnyArray:
        """(nk, …) the rows of one block in a table of all frames and blocks, such as 'stress'."""
        return self._table(f"frames/{name}", 0, self.n_frames, block)

    def _table(self, path: str, start: int, stop: int, *rest: int) -> AnyArray:
        rows = self._source.rows(path, start, stop, *rest)
        if problem := rows_problem(path, rows, self.n_blocks):
            raise InputError(f"the file is damaged: {problem}", self.path)
        length = self._view_length(path)
        if length is not None and start + len(rows) < min(length, stop):
            message = f"{path} has lost rows since the file was opened: refresh() reads the rest"
            raise InputError(message, self.path)
        if path.startswith("frames/") and (length is None or start < length <= stop):
            self._check_last_frame()
        return rows

    def _check_last_frame(self) -> None:
        """The last frame of an ended run is not one of the regular frames: it is removed when the run is resumed."""
        if self.n_frames == 0 or self.exit_reason == "running" or not self._source.has_changed():
            return
        step = self._source.rows("frames/step", self.n_frames - 1, self.n_frames)
        if len(step) == 0 or step[0] != self._last_frame:
            message = (
                "the run was resumed since the file was opened, and its last frame removed: "
                "refresh() reads the present state"
            )
            raise InputError(message, self.path)

    def _no_such_array(self, path: str) -> KeyError:
        return KeyError(f"{self.path} has no array {path!r}; it has: {', '.join(self.keys())}")

    def _view_length(self, path: str) -> int | None:
        group, _, name = path.partition("/")
        if group == "history":
            return self.n_steps
        if group == "frames" and name in FRAME_TABLES:
            return self.n_frames
        return self.n_frames + 1 if path == "frames/contact_offset" else None

    def _rows(self, path: str) -> int | None:
        group, _, name = path.partition("/")
        if (length := self._view_length(path)) is not None:
            return length
        if group == "frames" and name.startswith("contact_"):
            return int(self.rows("frames/contact_offset", self.n_frames, self.n_frames + 1)[0])
        return None

    def attribute(self, path: str, name: str) -> Any:
        """An attribute of an array in the file, texts as `str`."""

        def read(file: h5py.File) -> Any:
            value = file[path].attrs[name]
            return [plain(item) for item in value] if getattr(value, "shape", ()) else plain(value)

        return self._source.use(read)

    def point_blocks(self, kind: str) -> IntArray:
        """(n,) the blocks that hold the points of a kind: 'fixed', 'loading' or 'measured'."""
        return np.asarray(self.attribute(f"model/{kind}_points", "block"))

    def point_numbers(self, kind: str) -> IntArray:
        """(n,) numbers of the points of a kind in the input, from 1: a measured point that was ignored is missing."""

        def read(file: h5py.File) -> IntArray:
            points = file[f"model/{kind}_points"]
            return np.asarray(points.attrs.get("number", np.arange(1, len(points) + 1)))

        return self._source.use(read)

    @property
    def times(self) -> FloatArray:
        """(nk,) time of each frame."""
        return self["frames/time"]

    @property
    def steps(self) -> IntArray:
        """(nk,) step of each frame; 0 is the start."""
        return self["frames/step"]

    @property
    def energy_names(self) -> list[str]:
        """Names of the columns of `history/energy`."""
        return list(self.attribute("history/energy", "columns"))

    @property
    def has_energies(self) -> bool:
        """False where the options switched the energy balance off: all columns of `history/energy` are then zero."""
        return bool(np.any(self["history/energy"])) or not self._is_off("energy")

    @property
    def has_contacts(self) -> bool:
        """False where the options left the contacts out of the frames."""
        return bool(np.any(self["frames/contact_offset"])) or not self._is_off("contacts")

    def _is_off(self, name: str) -> bool:
        """Do the options switch this of &output off?"""
        given = [group[name] for group in self.input_groups.get("output", []) if name in group]
        return given[-1:] == [False]  # the last one counts

    def joints(self, frame: int = -1) -> pandas.DataFrame:
        """Points along the joints of a frame: a pandas table, whose rows are ordered joint by joint and along each.

        A joint is where two blocks face each other: `first` < `second`, from 0. Columns: joint (from 0), first, second,
        edge (vertex of the first block where its edge starts), material, x, y, x1, y1, x2, y2 (the part of the joint
        that the point represents), length, state, opening, slip, normal_stress (tension positive), shear_stress,
        mobilised (share of the shear strength, as the program has it; 0 where open or without strength; NaN in a file
        that does not hold it), force_x, force_y (on the first block).
        Raises InputError for a file without these values."""
        return self.joint_columns(frame).to_pandas("a table of joints")

    def joint_columns(self, frame: int = -1) -> Columns:
        """The columns of `joints`, as arrays."""
        return joint_points(self.frames[frame])

    # -- frames --------------------------------------------------------------------------------------------------

    def frame(self, index: int = -1) -> Frame:
        """One frame; negative numbers count from the end."""
        return self.frames[index]

    def frame_at(self, time: float) -> Frame:
        """The frame that is nearest to a time."""
        return self.frames[int(np.argmin(np.abs(self.times - time)))]

    def polygons(self, frame: int = -1) -> list[FloatArray]:
        """The blocks of a frame: for each an (m, 2) array of vertices, counter-clockwise, not closed [length]."""
        return self.frames[frame].polygons()

    def field(self, name: str, frame: int = -1) -> AnyArray:
        """(nb,) a number for each block of a frame; `rockdda.FIELDS` lists the names."""
        return self.frames[frame].field(name)

    # -- tables --------------------------------------------------------------------------------------------------

    def history(self) -> pandas.DataFrame:
        """One row per accepted step (the index), one column per number.

        time, dt, open_close_iterations, attempts, solver_iterations; open, sliding, locked: numbers of contacts;
        max_displacement of the step; unbalanced force at its end, stage: index in `results.stage_names`, and
        relaxation: released share of the forces of the last excavation (not in older files); energy_kinetic …
        energy_residual; then for each measured point i
        measured_displacement_i_x, _y (since the start), measured_stress_i_x, _y, _xy, measured_rotation_i, for each
        fixed point fixed_force_i_x, _y (of the support on the block), and for each boundary boundary_force_i_x, _y (on
        the blocks). Points and boundaries count from 1, as in the input files. Points keep their numbers where others
        were ignored: column k of `results["history/measured_rotation"]` is measured_rotation_i with
        i = `results.point_numbers("measured")[k]`."""
        return self.history_columns().to_pandas("a table of the history", "step")

    def history_columns(self) -> Columns:
        """The columns of `history`, as arrays, after the step."""
        tables = {name: self[f"history/{name}"] for name in HISTORY_TABLES}
        columns = Columns(step=tables["step"])
        for name in ("time", "dt", "open_close_iterations", "attempts", "solver_iterations"):
            columns[name] = tables[name]
        for i, name in enumerate(("open", "sliding", "locked")):
            columns[name] = tables["contacts"][:, i]
        columns["max_displacement"] = tables["max_displacement"]
        if "history/unbalanced" in self:
            columns.update({name: self[f"history/{name}"] for name in STAGE_TABLES})
        for i, name in enumerate(self.energy_names):
            columns[f"energy_{name}"] = tables["energy"][:, i]
        for i, number in enumerate(self.point_numbers("measured")):
            for c, component in enumerate("xy"):
                columns[f"measured_displacement_{number}_{component}"] = tables["measured_displacement"][:, i, c]
            for c, component in enumerate(("x", "y", "xy")):
                columns[f"measured_stress_{number}_{component}"] = tables["measured_stress"][:, i, c]
            columns[f"measured_rotation_{number}"] = tables["measured_rotation"][:, i]
        for i in range(tables["fixed_force"].shape[1]):
            for c, component in enumerate("xy"):
                columns[f"fixed_force_{i + 1}_{component}"] = tables["fixed_force"][:, i, c]
        force = self.boundary_force
        for i in range(force.shape[1]):
            for c, component in enumerate("xy"):
                columns[f"boundary_force_{i + 1}_{component}"] = force[:, i, c]
        return columns

    def to_xarray(self, contacts: bool = True) -> xarray.Dataset:
        """Frames, history and contacts as one labelled data set: see `rockdda.export.to_xarray`."""
        return draw_or_write("to_xarray", self, contacts)

    def to_geopandas(self, what: str = "blocks", frame: int = -1, **options: Any) -> geopandas.GeoDataFrame:
        """Blocks, joints or contacts of a frame as shapes with values: see `rockdda.export.to_geopandas`."""
        return draw_or_write("to_geopandas", self, what, frame, **options)

    # -- pictures and files --------------------------------------------------------------------------------------

    def plot(self, field: str | None = None, frame: int = -1, **options: Any) -> matplotlib.axes.Axes:
        """Draw the blocks of a frame, coloured by a field; returns the matplotlib axes. See `rockdda.plot.plot`."""
        return draw_or_write("plot", self, field=field, frame=frame, **options)

    def slider(self, field: str = "displacement", **options: Any) -> Any:
        """A slider over the frames, in a notebook (needs ipywidgets). See `rockdda.plot.slider`."""
        return draw_or_write("slider", self, field, **options)

    def animate(self, output: PathLike | None = None, **options: Any) -> Path:
        """Make a film (.mp4, .gif or .html; by default the stem of the results + .mp4 in the current folder).

        Returns its path. See `rockdda.film.animate`."""
        return draw_or_write("animate", self, output or f"{self.path.stem}.mp4", **options)

    def to_vtk(self, path: PathLike, **options: Any) -> Path:
        """Write the frames for ParaView and PyVista; returns the path. See `rockdda.export.to_vtk`."""
        return draw_or_write("to_vtk", self, path, **options)


def open(path: PathLike) -> Results:
    """Open a results file (.h5), also one that a run is still writing.

    Raises InputError, with the reason, for a file that is damaged or no results file."""
    return Results(path)
