# SPDX-License-Identifier: MIT
"""A results file made of formulas: a wall of rectangular blocks that shears, turns and is stressed linearly."""

from pathlib import Path

import h5py
import numpy as np

COLUMNS = [
    "kinetic",
    "strain",
    "gravity",
    "springs",
    "external_work",
    "friction",
    "numerical_dissipation",
    "discarded",
    "geometry",
    "residual",
]


def add_bolts(path: Path) -> None:
    """Two bolts: between the blocks 1 and 2, whose second end moves by 0.05 a frame in x, and from block 1 outside."""
    with h5py.File(path, "a") as file:
        k = np.arange(len(file["frames/time"]), dtype=float)
        ends = np.array([[[0.5, 0.5], [1.5, 0.5]], [[0.5, 0.75], [-1.0, 0.75]]])
        moved = np.repeat(ends[None], len(k), axis=0)
        moved[:, 0, 1, 0] += 0.05 * k
        file["model/bolt_ends"] = ends
        file["model/bolt_blocks"] = np.array([[0, 1], [0, -1]])
        file["model/bolt_properties"] = np.array([[1e6, 100.0, 0.0], [2e6, 0.0, 5e3]])
        file.create_dataset("frames/bolt_ends", data=moved, maxshape=(None, 2, 2, 2))
        force = np.stack([100 + 5e4 * k, -k], axis=1)
        file.create_dataset("frames/bolt_force", data=force, maxshape=(None, 2))


def write_wall(path: Path, columns: int, rows: int, frames: int = 3, complete: bool = True) -> Path:
    """columns × rows unit squares; block 0 at the origin. Frame k at time 0.1 k: x moves by k y/100, y by -k/50.

    Stress in frame k: σx = -k x, σy = -2 k y, τxy = k/2 at the centroids. Three contacts, one of each state.
    """
    x, y = np.meshgrid(np.arange(columns, dtype=float), np.arange(rows, dtype=float))
    corner = np.column_stack([x.ravel(), y.ravel()])
    vertices = (corner[:, None, :] + np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])).reshape(-1, 2)
    centroid = corner + 0.5
    nb, k = len(corner), np.arange(frames, dtype=float)

    def moved(points):
        return points[None] + k[:, None, None] * np.stack([points[:, 1] / 100, np.full(len(points), -0.02)], axis=1)

    steps = frames - 1
    step = np.arange(1, steps + 1)
    stress = np.stack([-centroid[:, 0], -2 * centroid[:, 1], np.full(nb, 0.5)], axis=1)
    with h5py.File(path, "w") as file:
        file.attrs.update(
            format="rockdda", format_version=1, program_version="0", title="wall", created="2026-01-01T00:00:00Z",
            complete=int(complete), exit_reason="finished" if complete else "running",
        )  # fmt: skip
        text = {"geometry": "", "analysis": "", "config": ""}
        for name, value in text.items():
            file[f"input/{name}"] = value
        model = {
            "vertex_offset": 4 * np.arange(nb + 1), "vertices": vertices, "edge_joint": np.ones(4 * nb, dtype=int),
            "block_material": 1 + np.arange(nb) % 2, "block_area": np.ones(nb), "block_centroid": centroid,
        }  # fmt: skip
        for name, value in model.items():
            file[f"model/{name}"] = value
        for name, points in (("fixed", centroid[:1]), ("loading", centroid[:0]), ("measured", centroid[-1:])):
            file[f"model/{name}_points"] = points
            file[f"model/{name}_points"].attrs["block"] = np.array([0, nb - 1])[: len(points)]
        measured = moved(centroid[-1:])[1:] - centroid[-1:]
        history = {
            "step": step, "time": 0.1 * step, "dt": np.full(steps, 0.1),
            "open_close_iterations": 2 + step % 3, "attempts": np.ones(steps, dtype=int),
            "solver_iterations": np.zeros(steps, dtype=int), "contacts": np.ones((steps, 3), dtype=int),
            "max_displacement": np.full(steps, 0.02), "energy": np.outer(step, np.arange(10.0) - 4),
            "measured_displacement": measured, "measured_stress": np.zeros((steps, 1, 3)),
            "measured_rotation": np.zeros((steps, 1)), "fixed_force": np.ones((steps, 1, 2)),
        }  # fmt: skip
        for name, value in history.items():
            file.create_dataset(f"history/{name}", data=value, maxshape=(None, *value.shape[1:]))
        file["history/energy"].attrs["columns"] = COLUMNS
        per_frame = {
            "step": np.arange(frames), "time": 0.1 * k, "vertices": moved(vertices), "centroid": moved(centroid),
            "rotation": np.zeros((frames, nb)), "stress": k[:, None, None] * stress,
            "velocity": np.zeros((frames, nb, 6)), "contact_offset": 3 * np.arange(frames + 1),
        }  # fmt: skip
        per_frame["contact_point"] = np.tile([[0.5, 1.0], [1.0, 0.5], [1.5, 1.0]], (frames, 1))
        per_frame["contact_force"] = np.tile([[0.0, 0.0], [3.0, 0.0], [0.0, -4.0]], (frames, 1))
        per_frame["contact_state"] = np.tile([0, 1, 2], frames)
        per_frame["contact_blocks"] = np.tile([[0, 1]], (3 * frames, 1))
        for name, value in per_frame.items():
            file.create_dataset(f"frames/{name}", data=value, maxshape=(None, *value.shape[1:]))
    return path
