# SPDX-License-Identifier: MIT
"""Pictures of results, made with matplotlib. Every kind is a function that returns the axes it drew into.

Blocks: `blocks`, `contours`, `stress_crosses`, `trajectories`, `thrust`, `contact_forces`, `joints`, `displacements`,
`water`; curves: `history`, `profile`, `joint_profile`, `energy`, `iterations`, `ground_reaction`; the search of a
critical factor: `mechanism`, `factor`; several runs side by side: `small_multiples`; with a mouse: `interactive`; in a
notebook: `slider`.
`plot` draws the kind that is named. `input_plot` draws geometry and block files before any run, `record` a record of
ground motion.
"""

from __future__ import annotations

from ..units import Units
from .block_maps import blocks, contact_forces, displacements, stress_crosses
from .curves import energy, history, iterations, profile, profile_data
from .ground_reaction import ground_reaction, ground_reaction_data
from .input_files import INPUT_KINDS, input_plot, is_input
from .joint_maps import joint_field_name, joint_profile, joint_profile_data, joints, thrust
from .kinds import KINDS, plot, save, small_multiples
from .records import record
from .search_maps import draw_search, draw_trials, factor, mechanism
from .stress_maps import contours, trajectories
from .support_maps import bolts, capacity, liner
from .water_maps import water
from .window import interactive, slider

__all__ = [
    "INPUT_KINDS", "KINDS", "Units", "blocks", "bolts", "capacity", "contact_forces", "contours", "displacements",
    "draw_search", "draw_trials", "energy", "factor", "ground_reaction", "ground_reaction_data", "history",
    "input_plot", "interactive", "is_input", "iterations", "joint_field_name", "joint_profile", "joint_profile_data",
    "joints", "liner", "mechanism", "plot", "profile", "profile_data", "record", "save", "slider", "small_multiples",
    "stress_crosses", "thrust", "trajectories", "water",
]  # fmt: skip
