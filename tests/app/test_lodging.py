# SPDX-License-Identifier: MIT
"""Blocks that stand inside each other at the end of a step, and large strains, are told with block and place."""

import itertools
import re

from support import ProgramTest

BLOCKS = """\
rockdda-blocks 1
e0 0.0001
blocks {n}
vertices {nv}
fixed 0
loading 0
measured 0
bolts 0
{blocks}
fixed_points
loading_points
measured_points
bolt_list
end
"""
MODEL = """\
&model geometry = 'a.blk', units = 'none' /
&block_material number = 1, density = 2500, young = {young}, poisson = 0.25, unit_weight = 0 /
&block_material number = 2, density = 2500, young = {young}, poisson = 0.25, unit_weight = 0, velocity = 0,{speed},0 /
&joint_material number = 1, friction = 30, normal_stiffness = {stiffness}, shear_stiffness = {stiffness} /
&boundary along = -6,-2, 6,-2, kind = 'fixed' /
&run t_end = {t_end} /
&time dt_max = {dt} /
"""
BASE = [(-6, -2), (6, -2), (6, 0), (-6, 0)]
# a base with a rib: not convex
RIBBED = [(-6, -2), (6, -2), (6, 0), (3, 0), (3, 2), (2, 2), (2, 0), (-6, 0)]
STRIKER = [(-0.5, 0.001), (0.5, 0.001), (0.5, 0.601), (-0.5, 0.601)]


class Lodging(ProgramTest):
    def run_blocks(self, blocks, *arguments, code=0, **values):
        values = {"young": 1e10, "speed": -5, "stiffness": 1e7, "t_end": 0.05, "dt": 1e-3} | values
        rows = []
        for number, (material, corners) in enumerate(blocks, start=1):
            rows += [f"block {number} {material} {len(corners)}", *(f"{x!r} {y!r} 1" for x, y in corners)]
        corners = sum(len(corners) for _, corners in blocks)
        self.write("a.blk", BLOCKS.format(n=len(blocks), nv=corners, blocks="\n".join(rows)))
        self.write("a.nml", MODEL.format(**values))
        outcome = self.run_program("run", "a.nml", "-o", "a.h5", "--force", *arguments)
        self.assertEqual(outcome.code, code, outcome.err)
        return [line for line in outcome.err.splitlines() if "inside each other" in line]

    def test_a_block_that_sinks_into_another_is_told_with_place_and_depth_until_it_grows_fivefold(self):
        for base in (BASE, RIBBED):
            with self.subTest(corners=len(base)):
                told = self.run_blocks([(1, base), (2, STRIKER)])
                # inradius as everywhere: twice the area over the perimeter, 0.375
                found = [
                    re.search(r"blocks 1 and 2 at \((\S+), (\S+)\) by (\S+) \((\S+) % of the inr", t).groups()
                    for t in told
                ]
                depths = [float(depth) for _, _, depth, _ in found]
                self.assertGreater(depths[0], 0.02 * 0.375)
                # in a step the block moves by 5 mm
                self.assertLess(depths[0], 0.02 * 0.375 + 0.005)
                self.assertTrue(all(b > 5 * a for a, b in itertools.pairwise(depths)), depths)
                x, y, depth, share = map(float, found[0])
                self.assertLess(abs(y + depth), 1e-4)
                self.assertLess(abs(abs(x) - 0.5), 0.01)
                self.assertAlmostEqual(share, 100 * depth / 0.375, delta=0.06)

    def test_strict_ends_the_run_at_that_step(self):
        (told,) = self.run_blocks([(1, BASE), (2, STRIKER)], "--strict", code=3)
        self.assertIn("rockdda: error: blocks stand inside each other after step", told)

    def test_the_step_does_not_depend_on_when_the_run_was_continued(self):
        whole = self.run_blocks([(1, BASE), (2, STRIKER)])
        self.run_blocks([(1, BASE), (2, STRIKER)], "--steps", "1")
        outcome = self.run_program("resume", "a.ckpt.h5", "--t-end", "0.05")
        rest = [line for line in outcome.err.splitlines() if "inside each other" in line]
        self.assertEqual(whole, rest)

    def test_a_resumed_run_repeated_what_had_been_reported(self):
        blocks = [(1, BASE), (2, STRIKER)]
        for values in ({}, {"young": 2e5, "stiffness": 1e9}):
            words = "is strained by" if values else "inside each other"
            self.run_blocks(blocks, **values)
            whole = [line for line in self.path("a.log").read_text().splitlines() if words in line]
            self.assertGreater(len(whole), 0)
            # after the first of them
            self.run_blocks(blocks, "--steps", "20", **values)
            outcome = self.run_program("resume", "a.ckpt.h5", "--t-end", "0.05")
            self.assertEqual(outcome.code, 0, outcome.err)
            parts = [line for line in self.path("a.log").read_text().splitlines() if words in line]
            self.assertEqual(whole, parts)

    def test_blocks_that_only_press_are_not_told(self):
        for base in (BASE, RIBBED):
            self.assertEqual(self.run_blocks([(1, base), (2, STRIKER)], speed=-1, stiffness=1e10), [])

    def test_a_block_strained_by_more_than_linear_elasticity_holds_is_named_once(self):
        self.run_blocks([(1, BASE), (2, STRIKER)], young=2e5, stiffness=1e9)
        outcome = self.run_program("run", "a.nml", "-o", "a.h5", "--force")
        (told,) = [line for line in outcome.err.splitlines() if "is strained by" in line]
        self.assertRegex(
            told, r"warning: block [12] at \(\S+, \S+\) is strained by \S+ % after step \d+, time \S+: blocks"
        )
