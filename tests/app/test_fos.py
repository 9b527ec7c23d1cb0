# SPDX-License-Identifier: MIT
"""`rockdda fos`: the factor at which models lose their equilibrium, and the promises of the command around it."""

import cmath
import itertools
import json
import math
import re
import signal
import subprocess
import unittest
from pathlib import Path

from resume_case import ResumeTest
from support import PROGRAM, h5py

if h5py is not None:
    import numpy as np
    from faults import Faults

MODELS = Path(__file__).parents[2] / "inputs"
STACK = str(MODELS / "stack")


def geometry(polygons, fixed):
    """A geometry file of closed polygons, the first of them the boundary."""
    lines = [(*p, *q, 1) for polygon in polygons for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True)]
    head = [0.001, f"{len(lines)} {len(polygons[0])}", 0, 0, len(fixed), 0, 0, 0]
    rows = [" ".join(repr(x) for x in line) for line in lines]
    return "\n".join([*map(str, head), *rows, *(f"{x} {y} {x} {y}" for x, y in fixed)]) + "\n"


#: A block 2 m wide and 1 m high on a level base that is fixed.
LEVEL = geometry([[(0, 0), (6, 0), (6, 1), (0, 1)], [(2, 1), (2, 2), (4, 2), (4, 1)]], [(0.5, 0.5), (5.5, 0.5)])


def slope(angle):
    """The same block on a plane that rises by an angle [deg] to the right."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turned = [
        [(x * c - y * s, x * s + y * c) for x, y in polygon]
        for polygon in ([(0, 0), (6, 0), (6, 1), (0, 1)], [(2, 1), (2, 2), (4, 2), (4, 1)])
    ]
    return geometry(turned, [(0.5 * c - 0.5 * s, 0.5 * s + 0.5 * c), (5.5 * c - 0.5 * s, 5.5 * s + 0.5 * c)])


def voussoirs(radius=5.0, thickness=0.5, n=31, span=120):
    """Outlines of an arch, from its right springing to the left one."""
    degrees = [90 - span / 2 + i * span / n for i in range(n + 1)]

    def point(r, i):
        return r * math.cos(math.radians(degrees[i])), r * math.sin(math.radians(degrees[i]))

    low, high = radius - thickness / 2, radius + thickness / 2
    return [[point(low, i), point(high, i), point(high, i + 1), point(low, i + 1)] for i in range(n)]


def skewback(joint, side):
    """A block behind a springing, from the intrados to the extrados; side 1: to the left of it."""
    (x, y), (u, v) = joint
    length = math.hypot(u - x, v - y)
    a, b = (u - x) / length, (v - y) / length
    n, m = -b * side, a * side
    low, high = (x - 0.3 * a, y - 0.3 * b), (u + 0.3 * a, v + 0.3 * b)
    return [low, high, (high[0] + n, high[1] + m), (low[0] + n, low[1] + m)]


def block_file(outlines, e0=1e-3, joints=None):
    """A block file of these outlines; joints: joint materials of blocks, or of each edge, 1 by default."""
    joints = joints or [1] * len(outlines)
    joints = [one if isinstance(one, list) else [one] * len(line) for one, line in zip(joints, outlines, strict=True)]
    counts = {"blocks": len(outlines), "vertices": sum(map(len, outlines)), "fixed": 0, "loading": 0, "measured": 0}
    lines = ["rockdda-blocks 1", f"e0 {e0}", *(f"{name} {n}" for name, n in counts.items()), "bolts 0"]
    for k, (outline, joint) in enumerate(zip(outlines, joints, strict=True)):
        lines += [f"block {k + 1} 1 {len(outline)}"]
        lines += [f"{x} {y} {material}" for (x, y), material in zip(outline, joint, strict=True)]
    return "\n".join([*lines, "fixed_points", "loading_points", "measured_points", "bolt_list", "end"]) + "\n"


def options(friction=30, cohesion=0, more=""):
    return (
        "&model geometry = 'block.dc' /\n"
        "&block_material number = 1, density = 2400, young = 20e9, poisson = 0.25 /\n"
        f"&joint_material number = 1, name = 'base', friction = {friction}, cohesion = {cohesion} /\n"
        "&load gravity = 9.81 /\n" + more
    )


class FosTest(ResumeTest):
    def search(self, *arguments, code=0):
        outcome = self.run_program("fos", *arguments, "--quiet", "--json")
        self.assertEqual(outcome.code, code, outcome.err)
        return outcome.json

    def block(self, text, **values):
        self.write("block.dc", text)
        self.write("block.nml", options(**values))
        return "block.nml"

    def soft_arch(self):
        """20 voussoirs, R 4, t 0.4, 120 degrees, on joints that give way by millimetres before it falls."""
        polygons = voussoirs(4.0, 0.4, 22, 132)
        self.write("block.blk", block_file(polygons, e0=1e-4))
        held = "".join(
            f"&boundary along = {p[0]!r},{p[1]!r}, {q[0]!r},{q[1]!r}, kind = 'fixed' /\n"
            for p, q in (polygons[0][:2], polygons[-1][2:])
        )
        self.write(
            "block.nml",
            "&model geometry = 'block.blk' /\n&load gravity = 9.81 /\n"
            "&block_material number = 1, density = 2500, young = 20e9, poisson = 0.2 /\n"
            "&joint_material number = 1, friction = 35, normal_stiffness = 5e9, shear_stiffness = 2e9 /\n"
            "&stage name = 'weight', until = 'equilibrium' /\n" + held,
        )
        return "block.nml"

    @staticmethod
    def without_time(result):
        for trial in result["trials"]:
            del trial["seconds"]
        return result


class Values(FosTest):
    """Closed forms: the bracket holds the truth, widened by the elasticity of the joints (1 % of the value)."""

    def assert_between(self, result, truth, share=0.01):
        self.assertLessEqual(result["low"], truth * (1 + share))
        self.assertGreaterEqual(result["high"], truth * (1 - share))
        self.assertAlmostEqual(result["factor"], (result["low"] + result["high"]) / 2, places=12)

    def test_strength_of_a_block_on_a_plane(self):
        result = self.search(self.block(slope(20), friction=35))
        self.assert_between(result, math.tan(math.radians(35)) / math.tan(math.radians(20)))
        self.assertLessEqual(result["high"] - result["low"], 0.01)
        self.assertEqual(result["search"], "strength")
        self.assertEqual(result["mechanism"], {"blocks": [1], "kind": "sliding"})

    def test_joints_that_are_hardly_compressed_have_no_more_strength(self):
        """Round-off of lengths, 1e-12 of the model, held a block of 1e15 N/m³ with 2.5 and one of 1e17 with 64."""
        for stiffness in ("1e15", "1e17"):
            name = self.block(slope(20), friction=f"35, normal_stiffness = {stiffness}")
            truth = math.tan(math.radians(35)) / math.tan(math.radians(20))
            self.assert_between(self.search(name, "--force"), truth)

    def test_corners_of_cells_have_the_material_of_their_joint(self):
        """Corners of tied cells at the ends of a joint had that of the base, or bore as tips: 1.9 to 9.8 for 0.74."""
        c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
        base, block = [
            [(x * c - y * s, x * s + y * c) for x, y in polygon]
            for polygon in ([(-3, -1), (3, -1), (3, 0), (-3, 0)], [(0, 0), (1, 0), (1, 0.5), (0, 0.5)])
        ]
        for size, sides in ((0.25, 1), (0.25, 2), (0.5, 1), (0.5, 2)):
            self.write("block.blk", block_file([base, block], 1e-6, [1, [2, sides, sides, sides]]))
            self.write(
                "block.nml",
                "&model geometry = 'block.blk' /\n"
                "&block_material number = 1, density = 2500, young = 20e9, poisson = 0.2 /\n"
                "&joint_material number = 1, friction = 52 /\n"
                "&joint_material number = 2, name = 'j', friction = 15 /\n"
                "&joint_material number = 3, friction = 45, cohesion = 1e7, tension = 5e6, tie = .true. /\n"
                "&load gravity = 9.81 /\n&region name = 'r', box = -0.5,-0.1,2,2 /\n"
                f"&boundary along = {base[0][0]},{base[0][1]}, {base[1][0]},{base[1][1]}, kind = 'fixed' /\n"
                f"&subdivide region = 'r', size = {size}, kind = 'triangles', joint_material = 3 /\n"
                "&stage name = 'w', until = 'equilibrium' /\n",
            )
            result = self.search("block.nml", "--joints", "j", "--force")
            self.assert_between(result, math.tan(math.radians(15)) / math.tan(math.radians(20)))

    def test_a_coarse_tolerance_of_the_stage_does_not_take_slides_for_rest(self):
        """3.24 with a tolerance of 0.1 and 7.99 with 0.2, since a block that slid slowly was stable."""
        rest = "&stage until = 'equilibrium', tolerance = {} /\n"
        plain = self.without_time(self.search(self.block(slope(20), friction=35, more=rest.format(1e-5))))
        for tolerance in (0.1, 0.5):
            text = rest.format(tolerance)
            found = self.without_time(self.search(self.block(slope(20), friction=35, more=text)))
            self.assertEqual(found["factor"], plain["factor"])
        # the stages before the last end as the model has them
        first = "&stage until = 'equilibrium', tolerance = 0.2 /\n"
        found = self.search(self.block(slope(20), friction=35, more=first + rest.format(1e-5)))
        self.assert_between(found, math.tan(math.radians(35)) / math.tan(math.radians(20)))

    def test_base_does_not_move_before_its_stage(self):
        """Motion of the base begins with the stage 'shaken', behind that of the search."""
        self.write("record.csv", "t, a\n0, -2\n1, -2\n2, -2\n")
        stages = (
            "&stage name = 'rest', until = 'equilibrium' /\n&stage name = 'shaken', kind = 'dynamic', duration = 1 /\n"
        )
        name = self.block(slope(25), friction=35, more=stages)
        at_rest = self.search(name, "--stage", "rest")
        self.assert_between(at_rest, math.tan(math.radians(35)) / math.tan(math.radians(25)))
        record, harmonic = "&quake record = 'record.csv' /\n", "&load harmonic = 3, 0, 0.5, 0, 0 /\n"
        for motion in (record, harmonic):
            self.write(name, options(friction=35, more=motion + stages))
            self.assertEqual(self.search(name, "--stage", "rest", "--force")["factor"], at_rest["factor"], motion)
            outcome = self.run_program("fos", name, "--quiet", "--force")
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn("the base still moves where the search begins", outcome.err)

    def test_friction_that_only_thrust_presses_on_is_told(self):
        """A column 0.4 x 1.5 m on 16 degrees turns about its toe. A block behind it touches it, and held it without a
        word: 2.65. With a gap of a micrometre it does not stand."""
        turn = cmath.rect(1, math.radians(16))
        boxes = ((-5, -2, 6, 0), (0, 0, 2, 1.5), (-0.4, 0, 0, 1.5))
        corners = [[(x, y), (u, y), (u, v), (x, v)] for x, y, u, v in boxes]
        outlines = [[((complex(*one) * turn).real, (complex(*one) * turn).imag) for one in box] for box in corners]
        self.write("column.blk", block_file(outlines, 1e-4))
        more = "&boundary along = {}, kind = 'fixed' /\n".format(
            ",".join(f"{v:.15g}" for p in outlines[0][:2] for v in p)
        )
        self.write("column.nml", options(friction=45, more=more).replace("block.dc", "column.blk"))
        outcome = self.run_program("fos", "column.nml", "--json")
        self.assertGreater(outcome.json["factor"], 1)
        told = "blocks hold each other by friction that only their own thrust presses on"
        self.assertEqual(sum(told in one["message"] for one in outcome.json["messages"]), 1, outcome.err)
        stiff = options(friction=45, more=more).replace("block.dc", "column.blk")
        self.write("column.nml", stiff.replace("cohesion = 0", "cohesion = 0, normal_stiffness = 1e10"))
        self.assertEqual(self.run_program("fos", "column.nml", "--force").code, 3)
        # a block that slides on a plane
        outcome = self.run_program("fos", self.block(slope(20), friction=35), "--json")
        self.assertNotIn(told, outcome.err)

    def test_work_of_a_failing_trial_tells_the_factor(self):
        """Friction over driving force of a block that slides is the factor: the trial of 2 tells both last ones."""
        truth = math.tan(math.radians(35)) / math.tan(math.radians(30))
        result = self.search(self.block(slope(30), friction=35))
        self.assert_between(result, truth, share=0)
        self.assertEqual([trial["value"] for trial in result["trials"]], [1, 2, 1.21875, 1.2109375])
        # a push that does work on a block against its friction
        result = self.search(self.block(LEVEL, friction=30), "--search", "push")
        self.assert_between(result, math.tan(math.radians(30)), share=0)
        self.assertEqual(
            [trial["value"] for trial in result["trials"]][:5],
            [0, 0.05, 0.15000000000000002, 0.35000000000000003, 0.75],
        )
        self.assertEqual(len(result["trials"]), 7)

    def test_blocks_inside_each_other_are_told(self):
        """A wedge on a plane that ends in a kink of the ground, H = 75 m: its factor is 0.733. Where its tip has gone
        into the ground the factor is said not to be one. With a slip at each end of an interval the ground held it in
        soft rock: 1.746."""
        toe, top = (32.58, 31.39), 75.19
        outlines = ([(-37.6, -37.6), (115.6, -37.6), (115.6, top), (toe[0], top), toe, (0, 0), (-37.6, 0)],
                    [(0, 0), toe, (toe[0], top), (11.0, top)])  # fmt: skip
        self.write("kink.blk", block_file(outlines, 0.005))
        for young, is_told in ((5e8, False), (1e10, True), (5e11, False)):
            self.write(
                "kink.nml",
                options(32.1363, 48452.6, "&boundary along = -37.6, -37.6, 115.6, -37.6, kind = 'fixed' /\n")
                .replace("block.dc", "kink.blk").replace("2400", "2600").replace("20e9", str(young)),
            )  # fmt: skip
            outcome = self.run_program("fos", "kink.nml", "--json")
            self.assertEqual(
                "blocks stand inside each other in the stable trial of" in outcome.err, is_told, outcome.err
            )
            self.assert_between(outcome.json, 0.733)

    def test_wedge_in_a_kink_of_one_block_or_of_two(self):
        """An active wedge on a plane of 59.5 degrees pushes a passive one on a flat plane; limit analysis gives 1.022.
        Where the joint between two blocks of the ground met the kink the tip of the wedge held it at 4.715."""
        plane, ridge = (2.611298409178854, 4.434504497576984), (0.14407271346276382, 1.068549226703738)
        outer, low, right = (-2.586013724509982, -0.3940247860974229), -4.0, 4.611298409178854
        wedges = ([(0, 0), (1.8652131494134674, 3.1675032125549882), (1.130037069979674, 3.1675032125549882), ridge],
                  [(-1.6162585778187388, -0.24626549131088932), (0, 0), ridge])  # fmt: skip
        one = [[outer, (outer[0], low), (right, low), (right, plane[1]), plane, (0, 0)]]
        two = [[outer, (outer[0], low), (0, low), (0, 0)], [(0, 0), (0, low), (right, low), (right, plane[1]), plane]]
        for ground in (one, two):
            blocks = [*ground, *wedges]
            count = sum(map(len, blocks))
            rows = [f"rockdda-blocks 1\ne0 1e-5\nblocks {len(blocks)}\nvertices {count}\nfixed {4 * len(ground)}"]
            rows.append("loading 0\nmeasured 0\nbolts 0")
            for k, outline in enumerate(blocks, 1):
                rows += [f"block {k} 1 {len(outline)}", *(f"{x} {y} 1" for x, y in outline)]
            rows.append("fixed_points")
            for k, outline in enumerate(ground, 1):
                middle = [sum(values) / len(outline) for values in zip(*outline, strict=True)]
                rows += [f"{x + 0.01 * (middle[0] - x)} {y + 0.01 * (middle[1] - y)} {k}" for x, y in outline[:4]]
            rows.append("loading_points\nmeasured_points\nbolt_list\nend\n")
            self.write("kink.blk", "\n".join(rows))
            self.write("kink.nml", options(35.66722141).replace("block.dc", "kink.blk"))
            self.assert_between(self.search("kink.nml"), 1.022)
        outcome = self.run_program("fos", "kink.nml")
        self.assertIn("note: the tip of block", outcome.err)
        self.assertIn("begins in a kink above block", outcome.err)
        self.assertTrue(outcome.out.splitlines()[-1].startswith("factor of safety: "), outcome.out)

    def test_bolts_that_take_their_force_too_late_are_named(self):
        """A tendon from the block up the slope: stiff it yields before the block has moved; slack and soft it would
        hold the block after some decimetres, which the verdict does not wait for."""
        c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
        ends = [(x * c - y * s, x * s + y * c) for x, y in ((3, 1.5), (5.8, 0.5))]
        along, across, weight, force = 2.8 / math.hypot(2.8, 1), 1 / math.hypot(2.8, 1), 2 * 2400 * 9.81, 15e3
        tangent = math.tan(math.radians(35))
        for area, slack in ((5e-4, False), (1.5e-7, True)):
            bolt = (
                f"&bolt name = 'tendon', kind = 'end_anchored', from = {ends[0][0]}, {ends[0][1]}, to = {ends[1][0]}, "
                f"{ends[1][1]}, area = {area}, young = 200e9, yield_force = {force} /\n"
            )
            self.block(slope(30), friction=35, more=bolt)
            outcome = self.run_program("fos", "block.nml")
            result = self.search("block.nml")
            held = 0 if slack else force
            truth = (weight * c + held * across) * tangent / (weight * s - held * along)
            self.assert_between(result, truth)
            (tendon,) = result["supports"]
            self.assertEqual((tendon["name"], tendon["kind"]), ("tendon", "bolt"))
            self.assertEqual(tendon["stable"]["state"], "elastic")
            if slack:
                self.assertLess(tendon["failing"]["use"], 0.05)
                self.assertRegex(outcome.err, r"warning: bolt 'tendon' carries \d[^ ]* % of its strength in the")
            else:
                self.assertAlmostEqual(tendon["failing"]["use"], 1, places=4)
                self.assertNotIn("carries", outcome.err)
                self.assertIn("; 15 kN, 100 %, ", outcome.out)

    def test_forces_of_supports_have_their_sign(self):
        """A prop below a block on a plane yields in compression."""
        c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
        ends = [(x * c - y * s, x * s + y * c) for x, y in ((2.2, 1.5), (0.5, 0.5))]
        length, weight, force = math.hypot(1.7, 1), 2 * 2400 * 9.81, 10e3
        self.block(
            slope(30),
            friction=35,
            more=f"&bolt name = 'prop', kind = 'spring', from = {ends[0][0]}, {ends[0][1]}, to = {ends[1][0]}, "
            f"{ends[1][1]}, stiffness = 1e9, yield_force = {force} /\n",
        )
        result = self.search("block.nml")
        held = weight * s - force * 1.7 / length
        self.assert_between(result, (weight * c - force / length) * math.tan(math.radians(35)) / held)
        self.assertAlmostEqual(result["supports"][0]["failing"]["force"], -force, delta=1e-3 * force)
        self.assertIn("; -10 kN, 100 %, ", self.run_program("fos", "block.nml").out)

    def test_bolts_without_grout_prop_nothing(self):
        """The same prop as a tendon or a yielding bolt, which goes slack: as without it. In grout it bears compression,
        and that is said."""
        c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
        ends = [(x * c - y * s, x * s + y * c) for x, y in ((2.2, 1.5), (0.5, 0.5))]
        common = f"from = {ends[0][0]}, {ends[0][1]}, to = {ends[1][0]}, {ends[1][1]}, diameter = 0.025, young = 200e9"
        truth = math.tan(math.radians(35)) / math.tan(math.radians(30))
        for kind, props in (
            ("kind = 'end_anchored', yield_force = 10e3", False),
            ("kind = 'yielding', plateau_force = 10e3, stroke = 0.2", False),
            ("kind = 'grouted', yield_force = 10e3, grout_stiffness = 1e9, grout_strength = 400e3", True),
        ):
            with self.subTest(kind):
                self.block(slope(30), friction=35, more=f"&bolt name = 'prop', {common}, {kind} /\n")
                result = self.search("block.nml")
                outcome = self.run_program("fos", "block.nml")
                if props:
                    self.assertGreater(result["factor"], 1.2 * truth)
                    self.assertIn("bolt 'prop' props what stands", outcome.err)
                    self.assertIn(" in compression\n", outcome.out)
                else:
                    self.assert_between(result, truth)
                    self.assertEqual(result["supports"][0]["failing"]["force"], 0)
                    self.assertNotIn("props", outcome.err)

    def test_steep_bolt_is_waited_for_until_it_bears(self):
        """A bolt 9 degrees from the normal of a plane yields at a slip of 12 mm, 0.9 % of the block. Most of
        what it holds is the friction of the joint that it presses together."""
        c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
        ends = [(x * c - y * s, x * s + y * c) for x, y in ((3, 1.9), (3.3, 0.1))]
        length, weight, force = math.hypot(0.3, 1.8), 2 * 2400 * 9.81, 15e3
        self.block(
            slope(30),
            friction=35,
            more=f"&bolt name = 'b', kind = 'end_anchored', from = {ends[0][0]}, {ends[0][1]}, to = {ends[1][0]}, "
            f"{ends[1][1]}, area = {force * length / (200e9 * 2.0e-3)}, young = 200e9, yield_force = {force} /\n",
        )

        def limit(slip):
            along, length = 0.3 + slip, math.hypot(0.3 + slip, 1.8)
            holds = (weight * c + force * 1.8 / length) * math.tan(math.radians(35))
            return holds / (weight * s - force * along / length)

        # the bolt turns as the block slips, and holds more: 1.3 % of the factor on 35 mm; judged sooner it was too low
        result = self.search("block.nml")
        stands = next(t for t in result["trials"] if t["value"] == result["low"])
        self.assertLessEqual(result["low"], limit(stands["displacement"]) * 1.002)
        self.assertGreaterEqual(result["high"], limit(0))
        self.assertGreater(result["supports"][0]["stable"]["use"], 0.9)

    def test_lower_values_are_tried_where_a_stable_trial_has_moved(self):
        """A slope of two sets with four soft bolts: a wedge fails from 1.79 to 1.87, and is caught by corners from 1.88
        to 2.02, where doubling lands."""
        bolts = [
            (19.3597238, 11.149913, 13.4850623, 8.18827672, 5686007.05, 284300.353),
            (20.8854372, 8.10964358, 15.8534482, 5.82653607, 2987520.5, 149376.025),
            (18.6868793, 12.4946626, 13.3283707, 11.417801, 310650.849, 93195.2548),
            (21.123773, 7.64430987, 14.061431, 7.32632781, 23395254.1, 233952.541),
        ]
        (self.folder / "c.dc").write_text((Path(__file__).parent / "caught_slope.dc").read_text())
        (self.folder / "c.nml").write_text(
            "&model geometry = 'c.dc' /\n&load gravity = 9.81 /\n"
            "&block_material number = 1, density = 2600, young = 2e10, poisson = 0.25 /\n"
            "&joint_material number = 1, friction = 34.07118627364868, cohesion = 0 /\n"
            "&joint_material number = 2, friction = 30.417726201921095 /\n&joint_material number = 3, friction = 35 /\n"
            "&boundary along = 0,18, 0,0, 34,0, 34,6, kind = 'fixed' /\n&stage until = 'equilibrium' /\n"
            + "".join(
                f"&bolt name = 'b{k}', kind = 'spring', from = {x},{y}, to = {u},{v}, stiffness = {stiffness}, "
                f"yield_force = {strength} /\n"
                for k, (x, y, u, v, stiffness, strength) in enumerate(bolts)
            )
        )
        outcome = self.run_program("fos", "c.nml", "--json")
        # a linear programme of rigid blocks with all bolts at yield: 1.792
        self.assertAlmostEqual(json.loads(outcome.out)["factor"], 1.792, delta=0.018)
        self.assertRegex(outcome.err, r"warning: the model stands at 2\.\d+ after a motion, and fails at lower values")
        # the trials have all values that counted: also that at which it is caught, and those below
        caught = float(re.search(r"the model stands at (\S+) after a motion", outcome.err)[1])
        trials = json.loads(outcome.out)["trials"]
        self.assertTrue(next(one["stable"] for one in trials if abs(one["value"] - caught) < 1e-4))
        self.assertTrue(any(not one["stable"] and one["value"] < caught for one in trials))
        values = [one["value"] for one in trials]
        self.assertEqual(len(values), len(set(values)))
        self.assertIn(f"; {len(values)} trials)", self.run_program("fos", "c.nml", "--quiet", "-o", "c.h5").out)
        if h5py is not None:
            with h5py.File(self.folder / "c.h5") as file:
                self.assertEqual(list(file["search/value"]), values)
        # trials that were computed ahead have changed which lower values were tried
        for jobs in ("2", "5"):
            other = self.search("c.nml", "--jobs", jobs)
            self.assertEqual(self.without_time(other), self.without_time(json.loads(outcome.out)))

    def test_a_wall_that_dilates_falls_at_the_lowest_tilt_at_which_it_fails(self):
        """Four bricks at the end of a wall tip about the foot of one of them, where its head joint does not rub. The
        joint opens by micrometres when the wall is tilted by more than that; from 29 degrees on it slips first,
        dilates and clamps, up to 30.1."""
        heights = (0, 0.531, 1.051, 1.384, 1.72, 1.964)
        cuts = ((0, 0.167, 0.677, 1.519), (0, 0.109, 0.884, 0.949, 1.519), (0, 0.294, 1.244, 1.519), (0, 1.081, 1.519),
                (0, 0.413, 1.01, 1.325, 1.519))  # fmt: skip
        boxes = [(-1.5, -1, 3.019, 0)]
        for low, high, course in zip(heights, heights[1:], cuts, strict=False):
            boxes += [(a, low, b, high) for a, b in itertools.pairwise(course)]
        self.write("wall.blk", block_file([[(x, y), (u, y), (u, v), (x, v)] for x, y, u, v in boxes], 2e-4))
        self.write(
            "wall.nml",
            options(37.22, 0, "&boundary along = -1.5,-1, 3.019,-1, kind = 'fixed' /\n&stage until = 'equilibrium' /\n")
            .replace("block.dc", "wall.blk").replace("cohesion = 0", "dilation = 37.18").replace("2400", "2233")
            .replace("poisson = 0.25", "poisson = 0.2").replace("20e9", "33.9e9"),
        )  # fmt: skip
        tipping = [(1.244, 1.051, 1.519, 1.384), (1.081, 1.384, 1.519, 1.72), (1.01, 1.72, 1.325, 1.964),
                   (1.325, 1.72, 1.519, 1.964)]  # fmt: skip
        areas = [(u - x) * (v - y) for x, y, u, v in tipping]
        arm = sum(area * (1.519 - (x + u) / 2) for area, (x, _, u, _) in zip(areas, tipping, strict=True))
        height = sum(area * ((y + v) / 2 - 1.051) for area, (_, y, _, v) in zip(areas, tipping, strict=True))
        truth = math.degrees(math.atan(arm / height))
        told = 0
        for end in (31, 32, 33):
            outcome = self.run_program("fos", "wall.nml", "--search", "tilt", "--to", str(end), "--json")
            # elastic joints clamp for a degree more, or not at all
            self.assertGreater(outcome.json["factor"], truth - 0.1)
            self.assertLess(outcome.json["factor"], truth + 1.3)
            self.assertEqual(outcome.json["mechanism"]["blocks"], [10, 12, 15, 16])
            warned = [one["message"] for one in outcome.json["messages"] if one["severity"] == "warning"]
            told += any(re.match(r"the model stands at (29|30)\S*, and fails at lower values", one) for one in warned)
            self.assertEqual(len(warned), outcome.err.count("rockdda: warning: "))
        self.assertGreater(told, 0)

    def test_a_splinter_that_decides_is_named(self):
        """Of three blocks on a plane the smallest one, of 0.5 % of the area, has the least friction."""
        c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
        boxes = [(0, 0, 9, 1), (1, 1, 3, 2), (4, 1, 6, 2), (7, 1, 7.1, 1.1)]
        outlines = [
            [(x * c - y * s, x * s + y * c) for x, y in ((a, b), (u, b), (u, v), (a, v))] for a, b, u, v in boxes
        ]
        more = (
            f"&joint_material number = 2, friction = 30 /\n&boundary along = 0,0, {9 * c},{9 * s}, kind = 'fixed' /\n"
        )
        self.write("block.nml", options(35, 0, more).replace("block.dc", "block.blk"))
        for joint, angle, blocks in ((2, 30, [3]), (1, 35, [1, 2, 3])):
            self.write("block.blk", block_file(outlines, joints=[1, 1, 1, joint]))
            outcome = self.run_program("fos", "block.nml", "--json")
            self.assert_between(outcome.json, math.tan(math.radians(angle)) / math.tan(math.radians(20)))
            self.assertEqual(outcome.json["mechanism"]["blocks"], blocks)
            self.assertAlmostEqual(outcome.json["moving_share"], 0.005 + (len(blocks) - 1), delta=1e-6)
            warned = [one["message"] for one in outcome.json["messages"] if one["severity"] == "warning"]
            if joint == 1:
                self.assertEqual(warned, [])
            else:
                self.assertRegex(
                    warned[0],
                    r"^the factor is that of a splinter: block 4 at \(6\.\d+, 3\.\d+\), 10000 mm², 0\.5 % of the area "
                    r"of a typical block \(2 m²\)",
                )
                self.assertIn(f"rockdda: warning: {warned[0]}", outcome.err)

    def test_a_splinter_that_no_strength_holds_is_named(self):
        """Beside blocks at rest a small one falls along the end of the base, as splinters of slopes did: no factor."""
        more = "&boundary along = 0,0, 9,0, kind = 'fixed' /\n"
        self.write("block.nml", options(35, 0, more).replace("block.dc", "block.blk"))
        told = r"what moves is no more than a splinter: block 4 at \(\S+, \S+\), 0.01 m², 0.5 % of the area of a"
        for size, is_splinter in ((0.1, True), (0.9, False)):
            boxes = [(0, 0, 9, 1), (1, 1, 3, 2), (4, 1, 6, 2), (9, 0, 9 + size, size)]
            outlines = [[(a, b), (u, b), (u, v), (a, v)] for a, b, u, v in boxes]
            self.write("block.blk", block_file(outlines))
            for search in ("strength", "push"):
                outcome = self.run_program("fos", "block.nml", "--search", search, "--quiet")
                self.assertEqual(outcome.code, 3, outcome.err)
                self.assertIn("the model does not stand", outcome.err)
                if is_splinter:
                    self.assertRegex(outcome.err, told)
                    self.assertNotIn("what fails has no finite factor", outcome.err)
                else:
                    self.assertNotIn("splinter", outcome.err)

    def test_strength_with_cohesion(self):
        # c = 10 kPa on 2 m, weight 2 m2 x 2400 x 9.81
        weight = 2 * 2400 * 9.81
        angle = math.radians(30)
        truth = (weight * math.cos(angle) * math.tan(math.radians(20)) + 20e3) / (weight * math.sin(angle))
        self.assert_between(self.search(self.block(slope(30), friction=20, cohesion=10e3)), truth)

    def test_factors_below_one_were_refused(self):
        """Plane failure: the verdict is that of the closed form, with the default tolerance and range."""
        weight = 2 * 2400 * 9.81

        def truth(angle, friction, cohesion):
            angle = math.radians(angle)
            resists = weight * math.cos(angle) * math.tan(math.radians(friction)) + 2 * cohesion
            return resists / (weight * math.sin(angle))

        cases = [
            (30, 29.5, 0),
            (30, 20, 0),
            (20, 4, 0),
            (20, 2, 0),
            (40, 2, 0),
            (20, 2, 3e3),
            (25, 0, 5e3),
            (30, 15, 3e3),
        ]
        for angle, friction, cohesion in cases:
            with self.subTest(angle=angle, friction=friction, cohesion=cohesion):
                result = self.search(self.block(slope(angle), friction=friction, cohesion=cohesion))
                self.assert_between(result, truth(angle, friction, cohesion))
                self.assertLessEqual(result["high"] - result["low"], 0.02 * result["factor"])
                self.assertGreater(result["settled_strength"], 1)
                self.assertEqual(result["mechanism"], {"blocks": [1], "kind": "sliding"})
        # from a given value, and between given ones
        name = self.block(slope(30), friction=20)
        self.assert_between(self.search(name, "--from", "0.5"), truth(30, 20, 0), share=0.02)
        self.assert_between(self.search(name, "--from", "0.3", "--to", "0.9"), truth(30, 20, 0), share=0.02)
        self.assertEqual(self.run_program("fos", name, "--from", "0.7", "--quiet").code, 3)

    def test_a_wedge_that_slid_away_before_the_search_has_its_factor_below_one(self):
        """Plane failure with a tension crack, dry and with water whose table falls to the toe."""
        slides = [(0, 0), (15.547005383792518, 7.2496876718394443), (15.547005383792518, 20), (11.547005383792518, 20)]
        ground = [(0, 0), (0, -3), (25, -3), (25, 20), slides[2], slides[1]]
        lines = [(*p, *q, 1) for p, q in zip(ground, ground[1:] + ground[:1], strict=True)]
        lines[4] = (*lines[4][:4], 2)  # the crack
        lines += [(*p, *q, 1) for p, q in ((slides[2], slides[3]), (slides[3], slides[0]))]
        points = [(1, -2), (24, -2), (24, 19)]
        head = [0.001, f"{len(lines)} {len(lines)}", 0, 0, len(points), 0, 0, 0]
        rows = [" ".join(map(repr, line)) for line in lines] + [f"{x} {y} {x} {y}" for x, y in points]
        self.write("block.dc", "\n".join(map(str, head + rows)) + "\n")
        water = "&water table = 0,0, 15.547,20, unit_weight = 9810, joints = '1, 2', surfaces = .false. /\n"
        crack = "&joint_material number = 2, friction = 0 /\n"
        # weight 3.335 MN, plane of 25 degrees and 17.154 m; uplift 1.073 MN, 0.797 MN in the crack
        angle, length = math.radians(25), 17.1543
        weight = 2400 * 9.81 * 139.1146
        for more, uplift, thrust in (("", 0, 0), (water, 1.07283e6, 0.79741e6)):
            normal = weight * math.cos(angle) - uplift - thrust * math.sin(angle)
            drives = weight * math.sin(angle) + thrust * math.cos(angle)
            truth = (5e3 * length + normal * math.tan(math.radians(15))) / drives
            with self.subTest(truth=truth):
                self.write("block.nml", options(friction=15, cohesion=5e3, more=crack + more))
                # a table in space has lost some per mille of its load when the verdict falls
                self.assert_between(self.search("block.nml", "--joints", "base"), truth, share=0.01)

    def test_tilt_of_a_block_and_of_a_stack(self):
        # the block slides at its friction angle, counter-clockwise to the right and clockwise to the left
        self.assert_between(self.search(self.block(LEVEL), "--search", "tilt"), 30)
        left = self.search("block.nml", "--search", "tilt", "--to", "-60")
        self.assert_between({k: -left[k] for k in ("factor",)} | {"low": -left["high"], "high": -left["low"]}, 30)
        # five blocks of 1 m: tan = 1/5
        result = self.search(STACK, "--search", "tilt")
        self.assert_between(result, math.degrees(math.atan(1 / 5)), share=0.2 / 11.31)
        self.assertEqual(result["mechanism"], {"blocks": [1, 2, 3, 4, 5], "kind": "toppling"})

    def test_slivers_between_soft_blocks_do_not_decide(self):
        """Layers of 1 cm move by more than a thousandth of their size while the stack deforms by millimetres."""
        polygons, y = [[(0, 0), (8, 0), (8, 1), (0, 1)]], 1.0
        for thickness in (1, 0.01, 1, 0.01, 1, 0.01):
            polygons.append([(2, y), (2, y + thickness), (6, y + thickness), (6, y)])
            y += thickness
        self.write("block.dc", geometry(polygons, [(0.5, 0.5), (7.5, 0.5)]).replace("0.001", "0.0001", 1))
        soft = (
            options().replace("20e9", "50e6").replace("cohesion = 0", "normal_stiffness = 5e7, shear_stiffness = 1e7")
        )
        self.write("block.nml", soft)
        found = self.search("block.nml", "--search", "tilt")
        self.assertAlmostEqual(found["factor"], 30, delta=0.3)

    def test_push_to_both_sides(self):
        truth = math.tan(math.radians(30))
        self.assert_between(self.search(self.block(LEVEL), "--search", "push"), truth)
        left = self.search("block.nml", "--search", "push", "--to", "-2")
        self.assertLess(left["high"], 0)
        self.assertAlmostEqual(left["factor"], -truth, delta=0.01)

    def test_gravity_against_cohesion(self):
        # friction 10 degrees on a plane of 30: cohesion carries what friction does not
        angle, weight = math.radians(30), 2 * 2400 * 9.81
        truth = 40e3 / (weight * (math.sin(angle) - math.cos(angle) * math.tan(math.radians(10))))
        self.assert_between(
            self.search(self.block(slope(30), friction=10, cohesion=20e3), "--search", "gravity"), truth
        )

    def test_a_trial_without_a_solution_ends_the_search_only_where_the_factor_rests_on_it(self):
        """Under 1e19 times its weight no step of a block can be solved; it slides under 4.82 times."""
        weight, c, s = 2 * 2400 * 9.81, math.cos(math.radians(30)), math.sin(math.radians(30))
        truth = 20e3 * 2 / (weight * (s - c * math.tan(math.radians(20))))
        model = self.block(slope(30), friction=20, cohesion=20e3)
        outcome = self.run_program("fos", model, "--search", "gravity", "--to", "1e20", "--json")
        self.assert_between(outcome.json, truth)
        self.assertEqual(outcome.json["trials"][1]["value"], 1e20)
        (warned,) = (one["message"] for one in outcome.json["messages"] if one["severity"] == "warning")
        self.assertRegex(
            warned, r"^the trial of \S+e\+18 has no verdict: step .*\n  it counts as failing; .* \(\d+ more\)$"
        )
        self.assertIn(warned, outcome.err)
        for jobs in ("2", "5"):
            other = self.search(model, "--search", "gravity", "--to", "1e20", "--jobs", jobs)
            self.assertEqual(self.without_time(other), self.without_time(outcome.json))
        # nothing but that trial fails
        outcome = self.run_program("fos", model, "--search", "gravity", "--to", "1e20", "--tolerance", "6e19")
        self.assertEqual(outcome.code, 3)
        self.assertRegex(outcome.err, r"error: the trial of \S+e\+(19|20) has no verdict: step")

    def test_cohesion_of_a_base_that_opens_at_one_end(self):
        """Linear stress on 3 (1 - 0.35) of 2 m."""
        weight = 2 * 2400 * 9.81
        truth = 20e3 * 3 * (1 - 0.5 * math.tan(math.radians(35))) / (weight * math.sin(math.radians(35)))
        name = self.block(slope(35), friction=0, cohesion=20e3)
        self.assert_between(self.search(name, "--search", "gravity"), truth)

    def test_bonds_break_at_the_stress_of_the_beam(self):
        """Tension 6 M/t^2 of a ledge 4 m long and 1 m thick, and 6 M/t^2 - W/t of a wall 4 m high that is pushed: a
        crack at the edge goes through."""
        rock = (
            "&model geometry = 'block.dc' /\n"
            "&block_material number = 1, density = 2500, unit_weight = 25e3, young = 20e9, poisson = 0.2 /\n"
            "&joint_material number = 1, friction = 35, cohesion = 50e6, tension = 2.4e6 /\n"
            "&load gravity = 10 /\n"
        )
        ledge = geometry(
            [[(-3, -2), (0, -2), (0, 3), (-3, 3)], [(0, 0), (4, 0), (4, 1), (0, 1)]], [(-2.5, -1.5), (-0.5, 2.5)]
        )
        wall = geometry(
            [[(-3, -2), (4, -2), (4, 0), (-3, 0)], [(0, 0), (1, 0), (1, 4), (0, 4)]], [(-2.5, -1), (3.5, -1)]
        )
        for points in (3, 5):
            self.write("block.nml", rock + f"&contact points = {points} /\n")
            self.write("block.dc", ledge)
            self.assert_between(self.search("block.nml"), 2.4e6 / (6 * 25e3 * 4 * 2))
            self.write("block.dc", wall)
            self.assert_between(self.search("block.nml", "--search", "push"), (2.4e6 + 100e3) / (6 * 100e3 * 2))

    def test_slips_that_hardly_fail_are_decided(self):
        """Cohesive bedding whose points open and close: forces that miss equilibrium by a thousandth are enough."""
        self.assertEqual(self.run_program("new", "slope", "demo").code, 0)
        # without its water: 1.645
        dry = re.sub(r"&water\b[^/]*/", "", self.path("demo.nml").read_text())
        dry = re.sub(r"&stage +name = 'wet'[^/]*/", "", dry)
        self.write("demo.nml", dry.replace(", water = 'none'", ""))
        outcome = self.run_program("fos", "demo.nml", "--from", "1.5", "--to", "1.75", "--quiet", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertNotIn("neither came to rest", outcome.err)
        failing = [trial for trial in outcome.json["trials"] if not trial["stable"]]
        self.assertLess(min(trial["unbalanced"] for trial in failing), 2e-3)
        self.assertLess(max(trial["steps"] for trial in failing), 1000)
        self.assertLess(max(trial["steps"] for trial in outcome.json["trials"] if trial["stable"]), 150)


class Loads(FosTest):
    """`--search load`: closed forms and a linear programme of rigid voussoirs."""

    weight = 2 * 2400 * 9.81
    slides = weight * math.tan(math.radians(30)) / 1000

    def assert_factor(self, result, truth, share=0.01):
        self.assertEqual(result["search"], "load")
        self.assertAlmostEqual(result["factor"], truth, delta=share * abs(truth))
        self.assertLessEqual(result["high"] - result["low"], 0.005 * abs(result["high"]) + 1e-12)

    def load(self, text, *arguments, **values):
        return self.search(self.block(LEVEL, more=text, **values), "--search", "load", *arguments)

    def test_every_kind_of_load(self):
        """A horizontal force of 1 kN pushes a block that slides at W tan φ."""
        for text in (
            "&loading_point name = 'push', at = 2,1.1, force = 1000,0 /\n",
            "&loading_point name = 'push', at = 2,1.1, 2,1.2, force = 0,0,0, 1,500,0 /\n",
            "&line_load name = 'push', ends = 2,1, 2,2, force_start = 1000,0 /\n",
            "&line_load name = 'push', ends = 2,1, 2,2, force_start = 500,0, table = 0,0, 3,2 /\n",
            "&boundary name = 'push', along = 2,1, 2,2, kind = 'traction', pressure = 1000 /\n",
            "&boundary name = 'push', along = 2,1, 2,2, kind = 'traction', stress = -500,0,0, table = 0,0, 3,2 /\n",
        ):
            with self.subTest(text=text):
                result = self.load(text)
                self.assert_factor(result, self.slides)
                self.assertEqual(result["loads"], ["push"])
                self.assertEqual(result["mechanism"], {"blocks": [1], "kind": "sliding"})

    def test_loads_that_are_not_named_stay(self):
        """20 kN at all times, 1 kN that lifts the block; the factor of the push alone, to either side, and of both."""
        text = (
            "&loading_point at = 2,1.1, force = 20e3,0 /\n&loading_point name = 'push', at = 2,1.2, force = 1000,0 /\n"
            "&loading_point name = 'lift', at = 3,2, force = 0,1000 /\n"
        )
        tangent = math.tan(math.radians(30))
        self.assert_factor(self.load(text, "--loads", "push"), self.slides - tangent - 20)
        left = self.search("block.nml", "--search", "load", "--loads", "Push", "--to", "-90")
        self.assert_factor(
            {**left, "high": -left["low"], "low": -left["high"], "factor": -left["factor"]}, self.slides - tangent + 20
        )
        both = (self.slides - 20) / (1 + tangent)
        self.assert_factor(self.search("block.nml", "--search", "load"), both)
        self.assert_factor(self.search("block.nml", "--search", "load", "--from", "2", "--to", "9"), both)

    def test_joints_that_lose_their_cohesion_where_they_open(self):
        """A footing on crossed joints whose cohesion goes as they open: forces jump there, and steps ended unsolved."""
        (self.folder / "j.dc").write_text((Path(__file__).parent / "jointed_footing.dc").read_text())
        (self.folder / "j.nml").write_text(
            "&model geometry = 'j.dc' /\n&load gravity = 9.81 /\n"
            "&block_material number = 1, name = 'rock', density = 2400, young = 20e9, poisson = 0.2 /\n"
            "&joint_material number = 1, name = 'joint', friction = 5, cohesion = 20e3 /\n"
            "&loading_point name = 'column', at = 0,0.5, force = 0,-1000 /\n&stage until = 'equilibrium' /\n"
        )
        # runs of the same joints, turned by parts of a millimetre, have 1,530 to 1,545
        self.assert_factor(self.search("j.nml", "--search", "load", "--loads", "column"), 1535, share=0.02)

    def test_loads_of_any_size(self):
        for force in (0.3, 3e8):
            text = f"&loading_point name = 'push', at = 2,1.1, force = {force},0 /\n"
            self.assert_factor(self.load(text), self.slides * 1000 / force)

    def test_the_last_line_has_the_digits_that_are_sure(self):
        self.block(LEVEL, more="&loading_point name = 'push', at = 2,1.1, force = 1000,0 /\n")
        outcome = self.run_program("fos", "block.nml", "--search", "load", "--loads", "push", "--quiet")
        self.assertIn("loads multiplied: push\n", outcome.out)
        self.assertRegex(
            outcome.out.splitlines()[-1],
            r"^load factor: 27\.\d+ \(stable at 2\d\.\d+, fails at 27\.\d+; \d+ trials\)$",
        )

    def test_arch_of_31_voussoirs(self):
        """Segment of 120 degrees, R 5, t 0.5, 20 kN/m3: loads of the linear programme of rigid voussoirs; stiffness of
        the joints times 4 changes them by less than 1 %."""
        for k, friction, truth in ((23, 31, 68.871), (15, 31, 132.773)):
            polygons = voussoirs()
            x, y = (sum(polygons[k][i][j] for i in (1, 2)) / 2 for j in (0, 1))
            skewbacks = [skewback(polygons[0][:2], -1), skewback(polygons[-1][:1:-1], 1)]
            held = [(sum(p[0] for p in s) / 4 + d, sum(p[1] for p in s) / 4) for s in skewbacks for d in (-0.1, 0.1)]
            polygons = [skewbacks[0], *polygons, skewbacks[1]]
            lines = [(*p, *q, 1) for one in polygons for p, q in zip(one, one[1:] + one[:1], strict=True)]
            head = [0.0005, f"{len(lines)} {len(lines)}", 0, 0, len(held), 0, 0, 0]
            rows = [" ".join(repr(v) for v in line) for line in lines] + [f"{a!r} {b!r} {a!r} {b!r}" for a, b in held]
            self.write("block.dc", "\n".join(map(str, head + rows)) + "\n")
            text = (
                "&model geometry = 'block.dc' /\n&load gravity = 10 /\n"
                "&block_material number = 1, density = 2000, young = 20e9, poisson = 0.2 /\n"
                f"&joint_material number = 1, friction = {friction} /\n"
                f"&loading_point name = 'axle', at = {x!r}, {y!r}, force = 0, -1000 /\n"
            )
            found = []
            for more in ("", "&contact stiffness = 6e11 /\n", "&contact stiffness = 24e11 /\n"):
                self.write("block.nml", text + more)
                found.append(self.search("block.nml", "--search", "load", "--loads", "axle"))
                self.assert_factor(found[-1], truth)
            self.assertAlmostEqual(found[2]["factor"], found[1]["factor"], delta=0.01 * truth)
            self.assertEqual(found[0]["mechanism"]["kind"], "toppling")

    def test_what_carries_no_load_or_any(self):
        text = "&loading_point name = 'lift', at = 3,2, force = 0,1 /\n"
        self.assert_factor(self.load(text), self.weight, share=0.01)
        outcome = self.run_program("fos", self.block(LEVEL, more=text), "--search", "load", "--to", "-1e4", "--quiet")
        self.assertEqual(outcome.code, 3)
        self.assertIn("stable at -10000, the upper end of the search of the load", outcome.err)
        # nothing rubs on the block from the start
        outcome = self.run_program(
            "fos", self.block(LEVEL, friction=0, more=text.replace("0,1", "1e3,0")), "--search", "load", "--quiet"
        )
        self.assertEqual(outcome.code, 3)
        self.assertIn("times the loads: nothing carries them", outcome.err)

    def test_motion_of_the_trial_on_which_the_factor_rests_is_told(self):
        """A soft spring with 30 kN stops a block that slides: by 50 mm under 53 kN, by 71 mm under 59.5 kN."""
        text = (
            "&loading_point name = 'push', at = 2,1.1, force = 1000,0 /\n"
            "&bolt kind = 'spring', from = 2.2,1.2, to = 0.5,0.9, stiffness = 5e5, yield_force = 30e3 /\n"
        )
        result = self.load(text)
        trials = {trial["value"]: trial for trial in result["trials"]}
        moved = [one for one in result["trials"] if one["stable"] and one["displacement"] > 0.01 * math.sqrt(2)]
        first = min(moved, key=lambda trial: trial["value"])
        last = trials[result["low"]]
        self.assertLess(first["value"], last["value"])
        (warned,) = [one["message"] for one in result["messages"] if "only after a motion" in one["message"]]
        self.assertIn(
            f"the trial of {last['value']:g} came to rest only after a motion of {last['displacement'] * 1e3:.3g} mm, "
            f"and that of {first['value']:g}, the nearest to the start that moved so, after "
            f"{first['displacement'] * 1e3:.3g} mm",
            warned,
        )
        self.assertIn(f"--to {first['value']:g}", warned)
        # one that moved so alone is named once
        result = self.search("block.nml", "--search", "load", "--to", "70", "--tolerance", "0.5")
        self.assertEqual(sum("and that of" in one["message"] for one in result["messages"]), 0)
        self.assertEqual(sum("only after a motion" in one["message"] for one in result["messages"]), 1)

    def test_names_that_do_not_exist(self):
        def error(*arguments):
            outcome = self.run_program("fos", "block.nml", "--quiet", *arguments)
            self.assertEqual(outcome.code, 2, outcome.err)
            return outcome.err

        self.block(LEVEL)
        self.assertIn("no load of the model has a name; give one to &loading_point", error("--search", "load"))
        text = "&loading_point name = 'push', at = 2,1.1, force = 1,0 /\n&line_load name = 'snow', ends = 2,2, 4,2, "
        self.block(LEVEL, more=text + "force_start = 0,-1 /\n")
        message = error("--search", "load", "--loads", "puhs")
        self.assertIn("there is no load 'puhs'; did you mean 'push'?; the loads are push, snow", message)
        self.assertIn("only --search load and --factors ec7", error("--loads", "push"))
        self.assertIn("there is no load 'hush'; did you mean 'push'?", error("--factors", "load.hush = 2"))
        self.assertIn("'frction' is none of friction, cohesion", error("--factors", "frction = 2"))
        self.assertIn("expected a number above 0, found '-1'", error("--factors", "friction = -1"))
        self.assertIn("friction is given twice", error("--factors", "friction = 1.25, Friction = 1.3"))
        self.assertIn("expected ec7 or NAME = VALUE, found 'ec8'", error("--factors", "ec8"))
        self.assertIn("the model has no &water", error("--factors", "water = 1.2"))
        self.assertIn("not of --search tilt", error("--factors", "ec7", "--search", "tilt"))
        self.assertIn("begins at 1", error("--factors", "ec7", "--from", "0.5"))
        self.block(LEVEL, more="&loading_point at = 2,9, force = 1,0 /\n")
        self.assertIn("loading point at (2, 9) lies in no block", error())
        self.block(LEVEL, more="&loading_point at = 2,1.1, points = 1, force = 1,0 /\n")
        self.assertIn("give points or at, not both", error())
        self.block(LEVEL, more="&boundary name = 'a', along = 0,0, 6,0, kind = 'fixed' /\n")
        self.assertIn("no load of the model has a name", error("--search", "load"))


class Designs(FosTest):
    """`--factors`: does the model stand with them, and what strength is left?"""

    def judge(self, name, factors, code, *arguments):
        outcome = self.run_program("fos", name, "--factors", factors, "--quiet", *arguments)
        self.assertEqual(outcome.code, code, outcome.err + outcome.out)
        return outcome.out

    def reserve(self, text):
        found = re.search(r"\nstands with the factored values: (yes|no), reserve (\d\.\d{3})\n$", text)
        self.assertTrue(found, text)
        return found[1], float(found[2])

    def test_strength_is_divided(self):
        tangent = math.tan(math.radians(20))
        for friction, answer, code in ((35, "yes", 0), (22, "no", 3)):
            self.block(slope(20), friction=friction)
            truth = math.tan(math.radians(friction)) / tangent / 1.25
            for factors in ("ec7", "friction = 1.25", "friction=1.25, cohesion = 2, tension = 3, water = 1"):
                found = self.reserve(self.judge("block.nml", factors, code))
                self.assertEqual(found[0], answer)
                self.assertAlmostEqual(found[1], truth, delta=0.003 * truth)
        found = json.loads(self.judge("block.nml", "ec7", 3, "--json"))
        self.assertIs(found["stands"], False)
        self.assertEqual(found["factors"], "friction 1.25, cohesion 1.25, tension 1.25, water 1")

    def test_loads_are_multiplied(self):
        """20 kN on a block that slides at 27.186 kN."""
        more = "&loading_point name = 'push', at = 2,1.1, force = 20e3,0 /\n"
        self.block(LEVEL, more=more)
        for factors, load, strength, code in (
            ("load.push = 1.3", 1.3, 1, 0),
            ("load.push = 1.4", 1.4, 1, 3),
            ("ec7", 1.3, 1.25, 3),
            ("load.push = 0.5, friction = 1.25", 0.5, 1.25, 0),
        ):
            found = self.reserve(self.judge("block.nml", factors, code))
            self.assertEqual(found[0], "no" if code else "yes")
            truth = Loads.slides / (20 * load * strength)
            self.assertAlmostEqual(found[1], truth, delta=0.003 * truth)

    def test_factors_that_make_joints_stronger_are_refused(self):
        self.block(slope(20), friction=35)
        for name in ("friction", "cohesion", "tension"):
            outcome = self.run_program("fos", "block.nml", "--factors", f"{name} = 0.5")
            self.assertFails(
                outcome,
                2,
                f"rockdda: error: option --factors: {name}: strengths are divided by their factor, which is at least "
                "1; found 0.5, with which joints would be stronger",
            )

    def test_a_tolerance_beyond_the_beginning_is_refused(self):
        self.block(slope(20), friction=35)
        begin = ((), "2", "1"), (("--from", "1.5"), "1.5", "1.5"), (("--search", "gravity"), "1", "1")
        for more, tolerance, start in begin:
            outcome = self.run_program("fos", "block.nml", "--tolerance", tolerance, *more)
            self.assertEqual(outcome.code, 2)
            text = f"option --tolerance: {tolerance} must be less than the value where the search begins, {start}"
            self.assertIn(text, outcome.err)

    def test_cohesion_and_friction_have_factors_of_their_own(self):
        weight, angle = 2 * 2400 * 9.81, math.radians(30)
        self.block(slope(30), friction=20, cohesion=10e3)
        truth = (weight * math.cos(angle) * math.tan(math.radians(20)) / 1.1 + 20e3 / 1.5) / (weight * math.sin(angle))
        found = self.reserve(self.judge("block.nml", "friction = 1.1, cohesion = 1.5", 0 if truth > 1 else 3))
        self.assertAlmostEqual(found[1], truth, delta=0.003 * truth)

    def test_sau_mau_ping(self):
        """Design values of c and tan φ over 1.25; water times 1.3 takes some of the reserve."""
        folder = MODELS / "sau_mau_ping"
        for name, truth in (("full", 0.9590), ("half_full", 1.1305), ("dry", 1.2675)):
            with self.subTest(name=name):
                text = self.judge(folder / f"{name}.nml", "ec7", 3 if truth < 1 else 0)
                self.assertAlmostEqual(self.reserve(text)[1], truth, delta=0.003 * truth)
        heavier = self.reserve(self.judge(folder / "half_full.nml", "ec7", 0))[1]
        lighter = self.reserve(self.judge(folder / "half_full.nml", "friction = 1.25, cohesion = 1.25, water = 1.3", 0))
        self.assertLess(lighter[1], heavier - 0.03)

    def test_what_needs_no_strength_stands(self):
        text = self.judge(self.block(LEVEL), "ec7", 0, "-o", "none.h5")
        self.assertTrue(text.endswith("stands with the factored values: yes, reserve above 64\n"), text)

    def test_joints_whose_strength_was_reduced(self):
        """The joints of the search, and how much of a cohesive one opens: a linear stress on 3 (1 - 0.5) of 2 m."""
        cohesion = 1.05 * 2 * 2400 * 9.81 * math.sin(math.radians(45)) / 1.5
        self.block(slope(45), friction=0, cohesion=cohesion)
        outcome = self.run_program("fos", "block.nml", "--quiet", "--to", "1.2")
        self.assertIn("strength reduced: base\n", outcome.out)
        found = re.search(r"\nopen at failure: (\d+\.\d) % of base \(([\d.]+) (m*) of 2 m\)\n", outcome.out)
        self.assertTrue(found, outcome.out)
        self.assertAlmostEqual(float(found[1]), 25, delta=0.5)
        joint = self.search("block.nml", "--to", "1.2")["joints"][0]
        self.assertEqual((joint["name"], joint["reduced"]), ("base", True))
        self.assertAlmostEqual(joint["length"], 2, delta=1e-3)


class Promises(FosTest):
    def test_the_last_line_tells_the_factor(self):
        outcome = self.run_program("fos", self.block(slope(20), friction=35), "--quiet")
        self.assertRegex(
            outcome.out.splitlines()[-1],
            r"^factor of safety: 1\.9\d\d \(stable at 1\.9\d\d, fails at 1\.9\d\d; \d+ trials\)$",
        )
        outcome = self.run_program("fos", "block.nml", "--quiet", "--search", "tilt")
        self.assertRegex(
            outcome.out.splitlines()[-1],
            r"^critical tilt: \d+\.\d\d \(stable at \d+\.\d\d, fails at \d+\.\d\d; \d+ trials\)$",
        )

    def test_jobs_do_not_change_the_result(self):
        one = self.without_time(self.search(STACK, "--search", "tilt"))
        for jobs in ("2", "5"):
            self.assertEqual(self.without_time(self.search(STACK, "--search", "tilt", "--jobs", jobs)), one)

    def test_a_trial_that_fails_by_few_steps_is_repeated(self):
        """Few long steps pass by the equilibrium of an arch (0.455), which stands up to 0.498."""
        one = self.without_time(self.search(self.soft_arch(), "--search", "push"))
        for jobs in ("2", "5"):
            self.assertEqual(self.without_time(self.search("block.nml", "--search", "push", "--jobs", jobs)), one)
        with self.path("block.nml").open("a") as file:
            file.write("&time max_open_close = 5, displacement_ratio = 1e-3 /\n")
        short = self.search("block.nml", "--search", "push")
        self.assertAlmostEqual(short["factor"], one["factor"], delta=0.0051)  # neighbouring intervals

    def test_a_search_that_is_killed_anywhere_continues(self):
        """Also between a trial that failed by few steps and the one that repeats it."""
        faults = Faults(self.folder)
        command = [PROGRAM, "fos", self.soft_arch(), "--search", "push", "--quiet", "--json"]

        def run(at):
            return subprocess.run(command, cwd=self.folder, capture_output=True, env=faults.environment(at, "kill"))

        whole = run(-1)
        if whole.returncode != 0:
            self.skipTest("nothing can be preloaded into this build")
        result = self.without_time(json.loads(whole.stdout))
        calls = int(self.path("calls").read_text())
        for at in range(calls - 60, calls, 4):
            with self.subTest(call=at):
                self.assertEqual(run(at).returncode, -signal.SIGKILL)
                again = self.search("block.nml", "--search", "push")
                self.assertEqual(self.without_time(again), result)

    def test_nothing_is_left_but_what_was_asked_for(self):
        self.block(slope(20), friction=35)
        before = set(Path(self.folder).iterdir())
        self.search("block.nml")
        self.assertEqual(set(Path(self.folder).iterdir()), before)

    @unittest.skipIf(h5py is None, "needs h5py")
    def test_the_failing_trial_as_results(self):
        result = self.search(self.block(slope(20), friction=35), "-o", "fails.h5")
        with h5py.File(self.path("fails.h5")) as file:
            search = file["search"]
            self.assertEqual(search.attrs["search"], "strength")
            self.assertEqual(search.attrs["kind"], "sliding")
            for name in ("factor", "low", "high"):
                self.assertEqual(search[name][0], result[name])
            for name in ("value", "stable", "steps", "unbalanced", "displacement"):
                self.assertEqual(search[name][:].tolist(), [trial[name] for trial in result["trials"]])
            self.assertEqual(search["blocks"][:].tolist(), [1])
            self.assertEqual(search["block_kind"][:].tolist(), [0])
            centroid = file["frames/centroid"][:, 1]
            fails = next(t for t in result["trials"] if t["value"] == result["high"])
            self.assertEqual(len(file["history/step"]), fails["steps"])
            moved = np.hypot(*(centroid[-1] - centroid[0]))
            self.assertAlmostEqual(moved, fails["displacement"], delta=1e-3 * moved)
            self.assertEqual(file.attrs["exit_reason"], "finished")
        self.assertFalse(self.path("fails.ckpt.h5").exists())
        info = self.run_program("info", "fails.h5")
        self.assertEqual(info.code, 0, info.err)

    @unittest.skipIf(h5py is None, "needs h5py")
    def test_a_trial_takes_no_step_as_long_as_one_that_had_to_be_cut(self):
        width, height, course = 1.2, 1.2, 0.4
        outline = [(-1, -1), (2.2, -1), (2.2, 0), (width, 0), (width, height), (0, height), (0, 0), (-1, 0)]
        lines = [(*p, *q) for p, q in zip(outline, outline[1:] + outline[:1], strict=True)]
        lines += [(0, k * course, width, k * course) for k in range(3)]
        joints = {0: (0.6,), 1: (0.3, 0.9), 2: (0.6,)}
        lines += [(x, k * course, x, (k + 1) * course) for k in joints for x in joints[k]]
        head = [0.001, f"{len(lines)} {len(outline)}", 0, 0, 2, 0, 0, 0]
        rows = [" ".join(map(repr, (*line, 1))) for line in lines]
        wall = "\n".join([*map(str, head), *rows, "-0.5 -0.5 -0.5 -0.5", "1.7 -0.5 1.7 -0.5"]) + "\n"
        model = self.block(wall, friction=33)
        self.search(model, "--search", "push", "--tolerance", "0.002", "-o", "fails.h5")
        with h5py.File(self.path("fails.h5")) as file:
            attempts, dt = file["history/attempts"][:], file["history/dt"][:]
        tried = dt / 0.3 ** (attempts - 1)  # a cut leaves 0.3 of a step
        cut = np.flatnonzero(attempts[:-1] > 1)
        self.assertGreater(len(cut), 0)
        self.assertTrue(np.all(tried[cut + 1] <= 0.7 * tried[cut] * (1 + 1e-12)), (tried, attempts))

    def test_a_killed_search_continues(self):
        for friction in (35, 15):  # the model stands, or it is settled with twice its strength
            with self.subTest(friction=friction):
                self.kill_and_continue(friction)

    def kill_and_continue(self, friction):
        self.block(slope(20), friction=friction)
        whole = self.without_time(self.search("block.nml"))
        lines = self.kill()
        self.assertGreater(len(lines.read_text().splitlines()) - 2, 1)
        # a line that was cut off by the kill does not count
        with lines.open("a") as file:
            file.write("1.5 1 1 20 1")
        again = self.search("block.nml")
        self.assertEqual(self.without_time(again), whole)
        self.assertEqual(list(Path(self.folder).glob("*.fos-*")), [])

    def kill(self):
        """Kill a search when it has some trials; the list of them."""
        command = [PROGRAM, "fos", "block.nml", "--quiet", "--json"]
        for _ in range(20):
            process = subprocess.Popen(command, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            while process.poll() is None:
                lists = list(Path(self.folder).glob("*.fos-*.txt"))
                try:
                    is_begun = bool(lists) and len(lists[0].read_text().splitlines()) > 3
                except FileNotFoundError:  # the search has ended
                    break
                if is_begun:
                    process.send_signal(signal.SIGKILL)
                    break
            process.communicate()
            # a search that has just ended has removed its list
            lists = list(Path(self.folder).glob("*.fos-*.txt"))
            if process.returncode < 0 and lists:
                return lists[0]
        self.skipTest("the search is always faster than the kill")
        return None

    def test_a_search_of_another_model_takes_its_files_over(self):
        """The trials kept of a search belong to the model and the water that they had."""
        water = "&water name = 'w', pressure_file = 'p.csv' /\n"
        for edit in ("friction", "pressure"):
            with self.subTest(edit=edit):
                wet = "\n".join(["x,y,p", *(f"{x},{y},{{}}" for x in (-9, 9) for y in (-9, 9))]) + "\n"
                self.write("p.csv", wet.replace("{}", "0"))
                self.block(slope(20), friction=35, more=water)
                old = self.kill().read_text()
                if edit == "friction":
                    self.block(slope(20), friction=33, more=water)
                else:
                    self.write("p.csv", wet.replace("{}", "3000"))
                new = self.search("block.nml")
                self.assertEqual(list(Path(self.folder).glob("*.fos-*")), [])
                self.assertEqual(self.without_time(new), self.without_time(self.search("block.nml")))
                # trials of the old model behind the head of the new one, as of a search that was still running
                lines = self.kill()
                with lines.open("a") as file:
                    file.writelines(f"{line}\n" for line in old.splitlines()[2:])
                self.assertEqual(self.without_time(self.search("block.nml")), new)

    def test_a_signal_stops_in_order(self):
        outcome = self.run_program("fos", STACK, "--search", "tilt", "--max-wall", "1e-6", "--quiet")
        self.assertEqual(outcome.code, 4, outcome.err)
        self.assertIn("the same command continues", outcome.err)


class Refusals(FosTest):
    def error(self, *arguments, code=2):
        outcome = self.run_program("fos", *arguments, "--quiet")
        self.assertEqual(outcome.code, code, outcome.err)
        self.assertEqual(outcome.out, "")
        return outcome.err

    def test_no_factor_between_the_ends(self):
        self.block(slope(20), friction=35)
        self.assertIn("not stable at 2.5", self.error("block.nml", "--from", "2.5", code=3))
        self.assertIn("begin lower with --from", self.error("block.nml", "--from", "2.5", code=3))
        self.assertIn("stable at 1.5", self.error("block.nml", "--to", "1.5", code=3))
        result = self.search("block.nml", "--to", "1.5", code=3)
        self.assertEqual((result["status"], result["exit_code"]), ("error", 3))

    def test_a_first_trial_without_a_verdict_asks_for_steps(self):
        """It is not known whether the model is stable there."""
        way = (self.soft_arch(), "--search", "push", "--from", "0.4")
        message = self.error(*way, "--max-steps", "4", code=3)
        self.assertIn("not found to be stable at 0.4, the lower end of the search", message)
        self.assertIn("steps; give it more with --max-steps, now 4\n", message)
        self.assertNotIn("begin lower", message)
        self.assertGreater(self.search(*way)["low"], 0.4)

    def test_no_rest_before_the_search(self):
        more = "&stage name = 'weight', kind = 'static', until = 'equilibrium', max_steps = 30 /\n"
        text = self.error(self.block(slope(30), friction=20, more=more), "--search", "tilt", code=3)
        self.assertIn("did not come to equilibrium", text)
        self.assertIn("a search begins at rest", text)

    def test_a_model_that_nearly_comes_to_rest_is_no_failure(self):
        """No forces balance to 1e-16: it is not said that something fails, and what may help is."""
        self.soft_arch()
        text = self.path("block.nml").read_text().replace("'equilibrium'", "'equilibrium', tolerance = 1e-16{}")
        for more, steps in (("", "1000"), (", max_steps = 20", r"\d+")):
            self.write("block.nml", text.format(more))
            for kind in ("push", "strength"):
                with self.subTest(kind=kind, more=more):
                    message = self.error("block.nml", "--search", kind, code=3)
                    self.assertRegex(
                        message,
                        rf"did not come to rest.*: stage 'weight' did not come to equilibrium in {steps} steps "
                        r"\(unbalanced .*, tolerance 1e-16\)",
                    )
                    self.assertIn("nothing was found to slide or fall", message)
                    self.assertIn("(&time max_open_close = 40, now 20)", message)
                    self.assertNotIn("no finite factor", message)
                    self.assertNotIn("does not stand", message)
        # the numbers that it has are valid options
        self.write("block.nml", text.replace(", tolerance = 1e-16{}", "") + "&time max_open_close = 40 /\n")
        self.assertEqual(self.run_program("fos", "block.nml", "--search", "push").code, 0)

    def test_a_block_that_slides_for_ever_is_refused_early(self):
        """30° of slope, 20° of friction: it would use all 5,000 steps of the stage."""
        outcome = self.run_program("fos", str(MODELS / "incline"), "--search", "tilt", "--quiet", "--json")
        self.assertEqual(outcome.code, 3)
        message = outcome.json["messages"][0]["message"]
        self.assertIn("did not come to equilibrium", message)
        self.assertIn("does not fall", message)
        self.assertIn("--search strength", message)

    def test_a_model_that_moved_before_the_search_got_a_factor(self):
        """A block that is drawn above its base falls on it, whatever its strength."""
        base = [(0, 0), (6, 0), (6, 1), (0, 1)]
        for gap in (0.2, 0.02):
            block = [(2, 1 + gap), (2, 2 + gap), (4, 2 + gap), (4, 1 + gap)]
            self.write("block.dc", geometry([base, block], [(0.5, 0.5), (5.5, 0.5)]))
            self.write("block.nml", options())
            for kind in ("strength", "tilt", "push", "gravity"):
                with self.subTest(gap=gap, kind=kind):
                    text = self.error("block.nml", "--search", kind, code=3)
                    self.assertRegex(
                        text, r"the model does not stand.*: .*block 2 at \(3, 1.\d+\) has moved by [\d.]+ mm, "
                    )
        self.block(LEVEL)
        self.assertNotIn("stand", self.run_program("fos", "block.nml", "--search", "tilt").err)

    def test_motion_before_the_search_is_told(self):
        """A block 2 m wide and 1 m high falls through a gap that is drawn: 0.4 % of its size are 5.7 mm."""
        more = "&boundary along = 0,0, 6,0, kind = 'fixed' /\n"
        for gap, is_told in ((0.008, True), (0.002, False)):
            boxes = ((0, 0, 6, 1), (2, 1 + gap, 4, 2 + gap))
            self.write("block.blk", block_file([[(x, y), (u, y), (u, v), (x, v)] for x, y, u, v in boxes]))
            self.write("block.nml", options(30, more=more).replace("block.dc", "block.blk"))
            outcome = self.run_program("fos", "block.nml", "--search", "push", "--json")
            warned = [one["message"] for one in outcome.json["messages"] if one["severity"] == "warning"]
            told = [
                one
                for one in warned
                if re.search(r"block 2 at \S+ \S+ has moved by 8\.?\d* mm, further than 0.4 %", one)
            ]
            self.assertEqual(bool(told), is_told, warned)

    def test_what_no_strength_holds_is_refused(self):
        """A column that topples, a plane that is not searched, and a block that stands without strength."""
        column = [(2, 1), (2, 5), (3, 5), (3, 1)]
        base = [(0, 0), (6, 0), (6, 1), (0, 1)]
        c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
        turned = [[(x * c - y * s, x * s + y * c) for x, y in polygon] for polygon in (base, column)]
        fixed = [(x * c - 0.5 * s, x * s + 0.5 * c) for x in (0.5, 5.5)]
        self.write("block.dc", geometry(turned, fixed))
        self.write("block.nml", options(friction=40))
        self.assertIn("even with 64 times the strength", self.error("block.nml", code=3))
        other = "&joint_material number = 2, name = 'other', friction = 10 /\n"
        self.block(slope(20), friction=15, more=other)
        self.assertIn("even with 64 times the strength", self.error("block.nml", "--joints", "other", code=3))
        self.block(LEVEL)
        self.assertIn("stable at 64", self.error("block.nml", code=3))

    def test_what_nothing_fails_is_not_searched_further(self):
        """Blocks that only bear what presses on them: no larger value than a search tries by itself would be meant."""
        down = "&loading_point name = 'down', at = 3,2, force = 0,{} /\n"
        held = "35, cohesion = 1e9, tension = 1e9"
        told = {
            (35, -1e3, "load"): r"stable at 1e\+06, .* moved by up to \d.* without a mechanism, .*leave them room",
            (35, -1e-9, "load"): r"stable at 1e\+06, .* moved by no more than .*; give larger loads",
            (35, 0, "strength"): "stable at 64, .* shape or supports hold the model",
            (35, 0, "gravity"): "stable at 64, .* friction bears any weight",
            (held, 0, "tilt"): "stable at 85, .* nothing slides or falls",
            (held, 0, "push"): "stable at 10, .* nothing slides or falls",
        }
        for (friction, force, search), words in told.items():
            with self.subTest(search=search, force=force):
                self.write("block.dc", LEVEL)
                self.write("block.nml", options(friction, more=down.format(force)).replace(", cohesion = 0 ", " "))
                message = self.error("block.nml", "--search", search, code=3)
                self.assertRegex(message, words)
                self.assertNotIn("search further", message)
                # an end that the user has chosen
                end = {"load": "1e3", "tilt": "40", "push": "0.5"}.get(search, "2")
                self.assertIn("search further", self.error("block.nml", "--search", search, "--to", end, code=3))

    def test_no_factor_rests_on_blocks_inside_each_other(self):
        """A load 31 degrees off the normal slides a block with a friction of 30 under 25 times its weight. With soft
        joints the block is 2.6 % of its inradius inside the base by then, and what the joints are decides."""
        weight = 2 * 2400 * 9.81
        tangent = math.tan(math.radians(30))
        truth = tangent * weight / (600 - tangent * 1000)
        load = "&loading_point name = 'push', at = 3,1.1, force = 600,-1000 /\n"
        for stiffness, is_answer in (("4.7e9", True), ("4.7e7", False)):
            self.block(LEVEL, friction=f"30, normal_stiffness = {stiffness}", more=load)
            if is_answer:
                result = self.search("block.nml", "--search", "load")
                self.assertAlmostEqual(result["factor"], truth, delta=0.01 * truth)
                continue
            message = self.error("block.nml", "--search", "load", code=3)
            self.assertRegex(
                message,
                r"error: no factor: blocks stand inside each other in the stable trial of \d+, by up to 2\.\d % of the "
                r"inradius of the smaller one \(blocks 1 and 2 at \([234]\S*, (0\.9|1)\S*\)\)",
            )
            self.assertRegex(message, r"the model stands without it up to \d+\n")
        # other searches: 10 % more than at rest; 4.8 times the weight, and the strength, which presses nothing
        self.block(slope(30), friction="20, normal_stiffness = 1.25e6", cohesion=20e3)
        message = self.error("block.nml", "--search", "gravity", code=3)
        self.assertIn("no factor: blocks stand inside each other", message)
        self.block(slope(20), friction="35, normal_stiffness = 3.5e5")
        self.assertAlmostEqual(
            self.search("block.nml")["factor"], math.tan(math.radians(35)) / math.tan(math.radians(20)), delta=0.02
        )

    def test_tolerances_that_no_search_can_have(self):
        """As large as what is searched, or finer than the balance of forces at rest, 1e-5 of them."""
        push = "&loading_point name = 'push', at = 2,1.1, force = 1000,0 /\n"
        self.block(LEVEL, friction=30, more=push)
        wrong = {
            "strength": (("1", ()), ("9e-6", ()), ("1", ("--to", "2"))),
            "gravity": (("1", ()), ("9e-6", ())),
            "tilt": (("85", ()), ("40", ("--to", "-40")), ("5.7e-4", ())),
            "push": (("10", ()), ("0.7", ("--to", "0.7")), ("9e-6", ())),
            "load": (("1", ()), ("2", ("--to", "50")), ("9e-6", ())),
        }
        for search, cases in wrong.items():
            for tolerance, more in (*cases, *((one, ()) for one in ("0", "-0.1", "nan", "inf"))):
                with self.subTest(search=search, tolerance=tolerance):
                    message = self.error("block.nml", "--search", search, "--tolerance", tolerance, *more)
                    self.assertIn("option --tolerance: ", message)
        for search, tolerance in (("tilt", "1e-3"), ("push", "2e-5"), ("load", "2e-5")):
            result = self.search("block.nml", "--search", search, "--tolerance", tolerance)
            self.assertLessEqual(result["high"] - result["low"], float(tolerance) * max(1, result["high"]))

    def test_names_that_do_not_exist(self):
        more = "&stage name = 'weight', kind = 'static', until = 'equilibrium' /\n"
        self.block(slope(20), friction=35, more=more)
        self.assertIn(
            "there is no joint material 'bass'; did you mean 'base'?", self.error("block.nml", "--joints", "bass")
        )
        self.assertIn(
            "the model has no stage 'weigh'; did you mean 'weight'?", self.error("block.nml", "--stage", "weigh")
        )
        self.assertIn("did you mean 'tilt'?", self.error("block.nml", "--search", "till"))

    def test_values_that_make_no_search(self):
        self.block(slope(20), friction=35)
        self.assertIn("above 0", self.error("block.nml", "--from", "-1"))
        self.assertIn("must be larger", self.error("block.nml", "--from", "2", "--to", "1"))
        for search, start, end in (("tilt", "10", "5"), ("push", "0.4", "0.1"), ("tilt", "-10", "0")):
            self.assertIn("further from 0", self.error("block.nml", "--search", search, "--from", start, "--to", end))
        self.assertIn("further apart", self.error("block.nml", "--from", "1", "--to", "1.001"))
        self.assertIn("only a search of the strength", self.error("block.nml", "--search", "push", "--joints", "base"))


if __name__ == "__main__":
    unittest.main()
