# SPDX-License-Identifier: MIT
"""Blocks asleep beside boundaries, bolts and line loads: the same bits after a restart, the same places."""

import unittest

from resume_case import ResumeTest
from support import h5py

if h5py is not None:
    import numpy as np

COURSES, COLUMNS = 6, 8
SLIDER = 1 + COURSES * COLUMNS  # the row of the block that slides, from 0
OPTIONS = """\
&contact formulation = 'length' /
&time sleep = 'on', sleep_tolerance = 3e-3 /
&boundary along = -4,-1, 12,-1, kind = 'fixed' /
&line_load ends = 0,6, 1,6, force_start = 0,-1000, force_end = 0,-1000 /
&joint_material number = 1, damping_ratio = 0.3 /
&joint_material number = 2, friction = 0 /
"""


def write_model(test, solver):
    """A wall of columns of squares on a base, a bolt through two of them; a block slides along the base towards it."""
    boxes = [(-4.0, -1.0, 12.0, 0.0, 1)]
    boxes += [(i, j, i + 1, j + 1, 1) for j in range(COURSES) for i in range(COLUMNS)]
    boxes += [(-1.3, 0.0, -0.3, 1.0, 2)]
    lines = ["rockdda-blocks 1", "e0 0.001", f"blocks {len(boxes)}", f"vertices {4 * len(boxes)}"]
    lines += ["fixed 0", "loading 0", "measured 0", "bolts 1"]
    for number, (left, bottom, right, top, joint) in enumerate(boxes, start=1):
        corners = ((left, bottom), (right, bottom), (right, top), (left, top))
        lines += [f"block {number} {joint} 4", *(f"{x} {y} {joint}" for x, y in corners)]
    lines += ["fixed_points", "loading_points", "measured_points", "bolt_list"]
    lines += [f"{COLUMNS - 0.5} 1.5 {COLUMNS - 0.5} 3.5 {1 + 2 * COLUMNS} {1 + 4 * COLUMNS} 1e7 0 0", "end"]
    test.write("wall.blk", "\n".join(lines) + "\n")
    still, moving = ("2500 24525 1e9 0.25 0 0 0 0 0 0 " + v for v in ("0 0 0", "1 0 0"))
    test.write("wall.df", f"1\n500\n2\n2\n0.01\n0.002\n2e9\n{still}\n{moving}\n35 0 0\n0 0 0\n1.4\n")
    test.write("wall.nml", OPTIONS + f"&solver method = '{solver}' /\n")
    return "wall.blk", "wall.df", "--dialect", "g0", "--config", "wall.nml"


class Sleep(ResumeTest):
    def test_a_wall_that_is_struck(self):
        """The block strikes in step 150; the bolted blocks never sleep."""
        for solver in ("pcg", "cholmod"):
            with self.subTest(solver=solver):
                model = write_model(self, solver)
                options = ("--save-every", "50", "--quiet", "--force")
                self.good("run", *model, "-o", "whole.h5", "--steps", "590", "--threads", "1", *options)
                first = self.good("run", *model, "-o", "out.h5", "--steps", "550", "--threads", "4", "--json", *options)
                asleep = self.in_checkpoint("out.ckpt.h5", "state/asleep").astype(bool)
                self.assertGreater(asleep.sum(), 5)
                self.assertEqual(first.json["asleep_blocks"], asleep.sum())
                self.assertIn(f"# asleep: {asleep.sum()} of {len(asleep)} blocks;", self.path("out.log").read_text())
                self.assertFalse(asleep[[SLIDER, 2 * COLUMNS, 4 * COLUMNS]].any())
                self.good("resume", "out.ckpt.h5", "--steps", "10", "--threads", "2", "--quiet")
                self.good("resume", "out.ckpt.h5", "--steps", "30", "--threads", "1", "--quiet")
                self.assertSame("whole.h5", "out.h5")
                self.awake(model, options)

    def awake(self, model, options):
        """Without sleep the wall ends within 10 % of its displacement; with steps 2 % shorter it ends 14 % away."""
        text = self.path("wall.nml").read_text()
        self.write("wall.nml", text.replace("sleep = 'on'", "sleep = 'off'"))
        self.good("run", *model, "-o", "awake.h5", "--steps", "590", "--threads", "1", *options)
        moved = []
        for name in ("whole.h5", "awake.h5"):
            with h5py.File(self.path(name)) as file:
                centroid = file["frames/centroid"][()]
                moved.append((centroid[-1] - centroid[0])[1:SLIDER])
        self.assertLess(np.abs(moved[0] - moved[1]).max(), 0.1 * np.abs(moved[1]).max())


if __name__ == "__main__":
    unittest.main()
