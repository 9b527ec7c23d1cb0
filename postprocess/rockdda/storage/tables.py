# SPDX-License-Identifier: MIT
"""The tables of a results file: kind of their numbers, what a row holds, its quantity, and which files have them."""

from __future__ import annotations

from typing import NamedTuple

#: Powers of length, time and force of the quantities.
POWERS = {
    "length": (1, 0, 0), "area": (2, 0, 0), "time": (0, 1, 0), "rate": (0, -1, 0), "stress": (-2, 0, 1),
    "weight": (-3, 0, 1), "force": (0, 0, 1), "section": (-1, 0, 1), "energy": (1, 0, 1), "-": (0, 0, 0),
}  # fmt: skip
#: Numbers of a row; of the others the file has the size.
SIZES = {
    "xy": 2, "side": 2, "stress_component": 3, "velocity_component": 6, "energy_column": 10, "contact_count": 3,
    "property": 3, "nmq": 3, "section": 5, "of_beam": 6, "both_sides": 4,
}  # fmt: skip


class Table(NamedTuple):
    """One table."""

    kind: str  # 'i4', 'f8'; '-' where nothing checks it
    row: tuple[str, ...]  # dimensions of a row, by the names of SIZES or of what there is a number for each
    powers: tuple[int, int, int]
    #: '' each file; else what it needs: stages, bolts, nodes (of bolts), liners, joints; optional: those files that do
    needs: str


# Some columns are of other quantities: `units.ConvertedResults` has them.
_ROWS = """
model/vertices                f8  xy                         length
model/vertex_offset           i4  -                          -
model/edge_joint              i4  -                          -
model/block_material          i4  -                          -
model/block_area              f8  -                          area
model/block_centroid          f8  xy                         length
model/parent                  i4  -                          -         optional
model/fixed_points            f8  xy                         length
model/loading_points          f8  xy                         length
model/measured_points         f8  xy                         length
model/boundary_edges          i4  side                       -         optional
model/bolt_blocks             i4  side                       -         bolts
model/bolt_ends               f8  side,xy                    length    bolts
model/bolt_properties         f8  property                   force     bolts
model/bolt_first              i4  -                          -         nodes
model/liner_first             i4  -                          -         liners
model/liner_section           f8  section                    stress    liners
model/water_unit_weight       -   -                          weight
model/water_table             -   -                          length
model/water_level_time        -   -                          time
model/water_level_rise        -   -                          length
model/water_points            -   -                          length
model/water_pressure          -   -                          stress
search/displacement           -   -                          length
history/step                  i4  -                          -
history/time                  f8  -                          time
history/dt                    f8  -                          time
history/open_close_iterations i4  -                          -
history/attempts              i4  -                          -
history/solver_iterations     i4  -                          -
history/contacts              i4  contact_count              -
history/max_displacement      f8  -                          length
history/energy                f8  energy_column              energy
history/measured_displacement f8  measured,xy                length
history/measured_stress       f8  measured,stress_component  stress
history/measured_rotation     f8  measured                   -
history/fixed_force           f8  fixed,xy                   force
history/unbalanced            f8  -                          -         stages
history/stage                 i4  -                          -         stages
history/relaxation            f8  -                          -         stages
history/time_error            f8  -                          -         optional
history/boundary_force        f8  boundary,xy                force     optional
history/bolt_force            -   -                          force
history/bolt_head_force       -   -                          force
history/bolt_dowel            -   -                          force
history/bolt_energy           -   -                          energy
frames/step                   i4  -                          -
frames/time                   f8  -                          time
frames/vertices               f8  vertex,xy                  length
frames/centroid               f8  block,xy                   length
frames/rotation               f8  block                      -
frames/stress                 f8  block,stress_component     stress
frames/velocity               f8  block,velocity_component   rate
frames/active                 i4  block                      -         stages
frames/bolt_ends              f8  spring,side,xy             length    bolts
frames/bolt_force             f8  bolt_end                   force     bolts
frames/bolt_node              f8  node,xy                    length    nodes
frames/bolt_slip              f8  node                       length    nodes
frames/bolt_state             i4  node                       -         nodes
frames/bolt_use               f8  node                       -         optional
frames/liner_point            f8  liner_node,xy              length    liners
frames/liner_force            f8  liner_node,nmq             section  liners
frames/liner_state            i4  liner_node                 -         liners
frames/liner_sides            f8  liner_node,both_sides      section   optional
frames/liner_back             f8  liner_node,xy              length    optional
frames/liner_section          f8  liner_node,of_beam         section   optional
frames/liner_use              f8  liner_node                 -         optional
frames/contact_point          f8  xy                         length
frames/contact_force          f8  xy                         force
frames/contact_state          i4  -                          -
frames/contact_blocks         i4  side                       -
frames/contact_opening        f8  -                          length    joints
frames/contact_slip           f8  -                          length    joints
frames/contact_length         f8  -                          length    joints
frames/contact_normal_stress  f8  -                          stress    joints
frames/contact_shear_stress   f8  -                          stress    joints
frames/contact_strength       f8  -                          -         optional
frames/contact_offset         i4  -                          -
"""


def _read(path: str, kind: str, row: str, quantity: str, needs: str = "") -> tuple[str, Table]:
    return path, Table(kind, () if row == "-" else tuple(row.split(",")), POWERS[quantity], needs)


TABLES = dict(_read(*line.split()) for line in _ROWS.strip().split("\n"))


def names_in(group: str, *needs: str) -> list[str]:
    """Names of the checked tables of a group (without its name) that need one of these."""
    begin = f"{group}/"
    return [
        path.removeprefix(begin)
        for path, table in TABLES.items()
        if path.startswith(begin) and table.needs in needs and table.kind != "-"
    ]
