# SPDX-License-Identifier: MIT
"""Bolts along their length: in grout, held at their ends, yielding; by stage, resumed, and with other threads."""

import math
import unittest

from support import ProgramTest, h5py

HEAD = """\
&model geometry = '{name}.dc', units = 'none' /
&block_material number = 1, density = {density}, young = {young}, poisson = 0 {more}/
&joint_material number = 1, friction = {friction}, normal_stiffness = 1e10, shear_stiffness = 1e10 /
&load gravity = {gravity} /
"""
GLASS = (
    "kind = 'grouted', area = 181e-6, young = 98.6e9, grout_stiffness = 112e6, grout_strength = 175e3, "
    "plate_strength = 1e9, free_length = 0, 0.5"
)
FIXED = "&boundary along = {}, {}, {}, {}, kind = 'fixed' /\n"


def rectangle(x0, y0, x1, y1):
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return [(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]


@unittest.skipUnless(h5py, "needs h5py")
class Bars(ProgramTest):
    def make(self, name, boxes, groups, point=(0, 0), **values):
        lines = [line for box in boxes for line in rectangle(*box)]
        rows = [" ".join(map(repr, line)) + " 1" for line in lines]
        text = [f"0.001\n{len(rows)} {len(rows)}\n0\n0\n0\n0\n1\n0", *rows, f"{point[0]} {point[1]}"]
        self.write(f"{name}.dc", "\n".join(text) + "\n")
        values = {"density": 2500, "young": 1e12, "friction": 30, "gravity": 0, "more": "", **values}
        self.write(f"{name}.nml", HEAD.format(name=name, **values) + groups)

    def solve(self, name, *arguments):
        outcome = self.run_program("run", f"{name}.nml", "--force", *arguments)
        self.assertEqual(outcome.code, 0, outcome.err)
        return h5py.File(self.path(f"{name}.h5"))

    def hang(self, name, x, order=(0, 1, 2), more="", stages=None):
        """B4: a block of weight 100 on three bolts."""
        bolts = [
            f"&bolt name = 'b{i}', kind = 'end_anchored', from = {i - 1}, 0, to = {i - 1}, 3.5, area = 1e-4, "
            f"young = 2e12 {more.get(i, '') if isinstance(more, dict) else more}/\n"
            for i in order
        ]
        stages = stages or "&stage until = 'equilibrium', tolerance = 1e-7 /\n"
        groups = FIXED.format(-2, 4, 2, 4) + "".join(bolts) + stages
        boxes = [(-2.0, 3.0, 2.0, 4.0), (x - 1.25, 0.0, x + 1.25, 1.0)]
        self.make(name, boxes, groups, (x, 0.5), density=4, gravity=10, young=1e9)

    def test_equal_bolts_share_a_weight(self):
        for name, x, forces in [("mid", 0.0, [100 / 3] * 3), ("off", 0.2, [70 / 3, 100 / 3, 130 / 3])]:
            found = []
            for order in ((0, 1, 2), (2, 0, 1)):
                for threads in ("1", "2"):
                    self.hang(name, x, order)
                    with self.solve(name, "--threads", threads) as file:
                        at = [file["model/bolt_names"][()].tolist().index(f"b{i}".encode()) for i in range(3)]
                        found.append(file["history/bolt_force"][-1][at].tolist())
                        self.assertLess(abs(file["history/energy"][-1][-1]), 1e-12)
            for force in found:
                for computed, expected in zip(force, forces, strict=True):
                    self.assertAlmostEqual(computed, expected, delta=1e-6 * expected)

    def test_springs_beside_bolts_keep_their_names(self):
        spring = "&bolt {}from = {}, 0.5, to = {}, 3.5, stiffness = 1 /\n"
        more = spring.format("name = 'prop', ", 0.5, 0.5) + spring.format("", -0.5, -0.5)
        self.hang("mid", 0.0, stages=more + "&stage until = 'equilibrium', tolerance = 1e-7 /\n")
        with self.solve("mid") as file:
            names = [b"prop", b"spring 2", b"b0", b"b1", b"b2"]
            self.assertEqual(file["model/bolt_names"][()].tolist(), names)

    def test_ends_on_the_faces_of_blocks_hold(self):
        """Bolts through the air from the top of one block to the bottom of another were fixed to nothing."""
        self.hang("mid", 0.0)
        text = (self.path("mid.nml")).read_text(encoding="utf-8")
        self.write("mid.nml", text.replace(", 0, to", ", 1, to").replace(", 3.5, area", ", 3, area"))
        with self.solve("mid") as file:
            for force in file["history/bolt_force"][-1]:
                self.assertAlmostEqual(force, 100 / 3, delta=1e-6 * 100 / 3)
        self.assertNotIn("outside", self.run_program("check", "mid.nml").err)

    def test_excavated_rock_takes_its_part_of_a_bolt(self):
        """A bolt of 10 m with k/EA = 1/m^2, tensioned by 70 kN: P (1 - 1/cosh 5) in its middle. Rock is taken out of
        its middle, the bolt bridged the gap; two parts of 3 m are left, with P (1 - 1/cosh 1.5)."""
        grout = "kind = 'grouted', grout_stiffness = 1e8, grout_strength = 1e6, element = 0.1"
        stages = "&stage until = 'equilibrium' /\n&stage until = 'equilibrium', excavate = 'mid' /\n"
        for kind, before, after in ((grout, 69056.8, 40243.5), ("kind = 'end_anchored'", 7e4, 0)):
            groups = f"&region name = 'mid', box = -2, -2, 2, 2 /\n&bolt name = 't', from = -5, 0, to = 5, 0, {kind}, "
            groups += "area = 5e-4, young = 2e11, pretension = 7e4 /\n" + FIXED.format(-6, -1, 6, -1) + stages
            self.make("cut", [(-6.0, -1.0, -2.0, 1.0), (-2.0, -1.0, 2.0, 1.0), (2.0, -1.0, 6.0, 1.0)], groups)
            with self.solve("cut", "--strict") as file:
                stage, force = file["history/stage"][()], file["history/bolt_force"][:, 0]
                # rigid rock; elements of a tenth of the length in which the force falls
                self.assertAlmostEqual(force[stage == 0][-1], before, delta=1e-3 * 7e4)
                self.assertAlmostEqual(force[-1], after, delta=2e-3 * 7e4)
                place, state = file["frames/bolt_node"][-1, :, 0], file["frames/bolt_state"][-1]
                inside = abs(place) < 1.999 if after else place < 9
                self.assertEqual(set(state[inside].tolist()), {0})
                self.assertTrue((file["frames/bolt_force"][-1][inside] == 0).all())
                self.assertEqual(set(state[~inside].tolist()), {1} if after else set())
                energy = file["history/energy"][-1]
                self.assertLess(abs(energy[-1]), 1e-9 * abs(energy).max())

    def test_a_bolt_that_yields_or_breaks_leaves_the_rest_to_the_others(self):
        weak = ", yield_force = 20, rupture_strain = {} "
        for rupture, forces, state in [(1, (30, 20, 50), 3), (1e-8, (40, 0, 60), 4)]:
            self.hang("weak", 0.2, more={1: weak.format(rupture)})
            with self.solve("weak") as file:
                for computed, expected in zip(file["history/bolt_force"][-1], forces, strict=True):
                    self.assertAlmostEqual(computed, expected, delta=1e-6 * 60)
                self.assertEqual(file["frames/bolt_state"][-1].tolist(), [1, 1, state, state, 1, 1])

    def test_nodes_of_the_results(self):
        self.hang("mid", 0.0, more=", spacing_out_of_plane = 2")
        with self.solve("mid") as file:
            self.assertEqual(file["model/bolt_first"][()].tolist(), [0, 2, 4, 6])
            self.assertEqual(file["model/bolt_names"].attrs["spacing_out_of_plane"].tolist(), [2, 2, 2])
            # per bolt: two of them carry what three do in a metre
            for force in file["frames/bolt_force"][-1]:
                self.assertAlmostEqual(force, 200 / 3, delta=1e-4)
            self.assertEqual(file["frames/bolt_state"][-1].tolist(), [1] * 6)
            self.assertAlmostEqual(file["frames/bolt_node"][-1][1][1], 3.5, delta=1e-6)
            self.assertEqual(file["history/bolt_head_force"].shape, file["history/bolt_force"].shape)

    def pull(self, name, length, motion, more=""):
        """B1: the plate of a bolt is pulled out of fixed rock, with half a metre that is free."""
        moved = "&boundary along = -0.5, {0}, 0, {0}, kind = 'moving', velocity = -1e-3, 0 /\n"
        bolt = f"&bolt name = 'b', from = -0.5, 0, to = {length}, 0, element = {length / 10}, {GLASS} {more}/\n"
        groups = FIXED.format(0, -1, length + 0.5, -1) + FIXED.format(0, 1, length + 0.5, 1) + moved.format(0.5)
        groups += moved.format(-0.5) + bolt
        groups += f"&time dt_max = 0.1 /\n&stage kind = 'static', until_time = {motion / 1e-3} /\n"
        self.make(name, [(-0.5, -0.5, 0.0, 0.5), (0.0, -1.0, length + 0.5, 1.0)], groups, (-0.25, 0), young=1e14)

    def test_pulled_bolt_slips(self):
        self.pull("pulled", 1.0, 0.03)
        with self.solve("pulled") as file:
            force = file["history/bolt_head_force"][:, 0]
            head = -file["history/measured_displacement"][:, 0, 0] - force * 0.5 / (98.6e9 * 181e-6)
            small = abs(head - 1e-3).argmin()
            self.assertAlmostEqual(force[small] / head[small], 44.116e6, delta=0.01 * 44.116e6)
            for wanted, moved in [(110.42e3, 2.8029e-3), (146.81e3, 4.4498e-3), (170.05e3, 5.9511e-3)]:
                after = (head < moved).sum()
                share = (moved - head[after - 1]) / (head[after] - head[after - 1])
                there = force[after - 1] + share * (force[after] - force[after - 1])
                self.assertAlmostEqual(there, wanted, delta=0.02 * wanted)
            self.assertAlmostEqual(force[-1], 175e3, delta=0.01 * 175e3)
            energy = file["history/energy"][-1]
            self.assertLess(abs(energy[-1]), 1e-6 * energy[4])
            stored, slipped, yielded, broken = file["history/bolt_energy"][-1]
            self.assertAlmostEqual(stored + slipped, energy[4], delta=0.02 * energy[4])
            self.assertEqual((yielded, broken), (0, 0))
            self.assertIn(2, file["frames/bolt_state"][-1])

    def test_long_bolt_ruptures_at_its_yield_force(self):
        self.pull("long", 3.0, 0.2, ", yield_force = 500e3, rupture_strain = 0.05")
        with self.solve("long") as file:
            force = file["history/bolt_head_force"][:, 0]
            self.assertAlmostEqual(force.max(), 500e3, delta=0.01 * 500e3)
            self.assertEqual(file["frames/bolt_state"][-1].max(), 4)
            self.assertLess(force[-1], 0.9 * 500e3)
            self.assertGreater(file["history/bolt_energy"][-1][3], 0)

    def test_tensioned_bolt_holds_a_joint(self):
        """B5: the force at which a block of 5 t begins to slide, by its acceleration."""
        for angle in (90, 45):
            cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            reach = 0.5 / sin
            bolt = (
                f"&bolt kind = 'end_anchored', from = {reach * cos}, 0.5, to = {-3 * reach * cos}, -1.5, "
                "area = 1e-4, young = 2e5, pretension = 100e3 /\n"
            )
            groups = FIXED.format(-2, -2, 2, -2) + bolt + "&loading_point at = -1, 0.1, force = 200e3, 0 /\n"
            groups += "&line_load ends = -1, 1, 1, 1, force_start = 0, -50e3, force_end = 0, -50e3 /\n"
            groups += "&time dt_max = 1e-4 /\n&stage kind = 'dynamic', until_time = 0.01 /\n&run save_every = 1 /\n"
            self.make("shear", [(-2.0, -2.0, 2.0, 0.0), (-1.0, 0.0, 1.0, 1.0)], groups, (0, 0.5))
            with self.solve("shear") as file:
                block = file["model/block_area"][()].argmin()
                time, speed = file["frames/time"][60:], file["frames/velocity"][60:, block, 0]
                found = 200e3 - 5000 * (speed[-1] - speed[0]) / (time[-1] - time[0])
            expected = 1e5 * (math.tan(math.radians(30)) + cos + sin * math.tan(math.radians(30)))
            self.assertAlmostEqual(found, expected, delta=0.005 * expected)

    def test_yielding_bolt_stops_a_fall(self):
        """B6: 2 t after a fall of 1.5 m."""
        speed = math.sqrt(2 * 9.81 * 1.5)
        bolt = (
            "&bolt kind = 'yielding', from = 0, 0, to = 0, 3.5, area = 1e-3, young = 350e9, plateau_force = 200e3, "
            "stroke = {} /\n&time dt_max = 1e-3 /\n&stage kind = 'dynamic', until_time = 0.1 /\n"
        )
        for stroke in (0.5, 0.1):
            groups = FIXED.format(-2, 4, 2, 4) + bolt.format(stroke)
            boxes = [(-2.0, 3.0, 2.0, 4.0), (-0.5, 0.0, 0.5, 1.0)]
            more = f", velocity = 0, {-speed}, 0"
            self.make("fall", boxes, groups, (0, 0.5), density=2000, gravity=9.81, more=more)
            with self.solve("fall") as file:
                fallen = -file["history/measured_displacement"][:, 0, 1].min()
                yielded = file["history/bolt_energy"][-1][2]
                state = file["frames/bolt_state"][-1].max()
                force = file["history/bolt_force"][:, 0]
            self.assertAlmostEqual(force.max(), 200e3, delta=1)
            if stroke > 0.2:
                self.assertAlmostEqual(fallen, 0.16426, delta=0.01 * 0.16426)
                self.assertAlmostEqual(yielded, 32.453e3, delta=0.01 * 32.453e3)
                self.assertEqual(state, 1)
            else:
                self.assertEqual(state, 4)
                self.assertEqual(force[-1], 0)

    def test_dowels_stiffen_a_layered_roof(self):
        """B8: two layers of 0.25 m over 6 m, as tied cells; 8.100 mm without, 5.7899 mm with dowels."""
        for stiffness, expected in (("0", 8.1), ("52.3145e6", 5.7899)):
            rows = [" ".join(map(repr, line)) + " 1" for y in (0.0, 0.25) for line in rectangle(0.0, y, 6.0, y + 0.25)]
            ends = [f"{x} {y} {x} {y}" for x in (0, 6) for y in (0.125, 0.375)]
            self.write("layers.dc", "\n".join(["0.001\n8 8\n0\n0\n4\n0\n1\n0", *rows, *ends, "3 0.1"]) + "\n")
            dowels = "".join(
                f"&bolt kind = 'end_anchored', from = {x}, 0, to = {x}, 0.5, area = 4.909e-4, young = 1e6, "
                f"shear_stiffness = {stiffness} /\n"
                for x in (0.51, 1.51, 2.51, 3.51, 4.51, 5.49)
            )
            self.write(
                "layers.nml",
                "&model geometry = 'layers.dc', units = 'none' /\n"
                "&block_material number = 1, density = 2500, young = 10e9, poisson = 0 /\n"
                "&joint_material number = 1, friction = 0, normal_stiffness = 1e11, shear_stiffness = 1 /\n"
                "&joint_material number = 2, name = 'tied', friction = 30, tie = .true., normal_stiffness = 1e13, "
                "shear_stiffness = 1e13 /\n&load gravity = 10 /\n&subdivide size = 0.125, joint_material = 'tied' /\n"
                f"{dowels}&stage until = 'equilibrium', tolerance = 1e-5 /\n",
            )
            with self.solve("layers") as file:
                sag = -1e3 * file["history/measured_displacement"][-1][0][1]
                self.assertAlmostEqual(sag, expected, delta=0.03 * expected)
                self.assertGreaterEqual(file["history/bolt_dowel"][-1].min(), 0)
                self.assertEqual(file["history/bolt_dowel"][-1].max() > 3e4, stiffness != "0")

    def test_bolts_by_stage(self):
        still = "&stage until = 'equilibrium', tolerance = 1e-8"
        stages = f"{still} /\n{still}, remove = 'b1' /\n{still}, install = 'b3' /\n{still}, remove = 'b0, b2' /\n"
        extra = "&bolt name = 'b3', kind = 'end_anchored', from = 0, 0, to = 0, 3.5, area = 2e-4, young = 2e12 /\n"
        self.hang("built", 0.0, stages=extra + stages)
        with self.solve("built") as file:
            stage = file["history/stage"][()]
            ends = [file["history/bolt_force"][stage == s][-1].tolist() for s in range(4)]
            wanted = [[100 / 3] * 3 + [0], [50, 0, 50, 0], [50, 0, 50, 0], [0, 0, 0, 100]]
            for found, expected in zip(ends, wanted, strict=True):
                for a, b in zip(found, expected, strict=True):
                    self.assertAlmostEqual(a, b, delta=1e-3)
            self.assertEqual(file["frames/bolt_state"][-1].tolist(), [0] * 6 + [1, 1])
            self.assertLess(abs(file["history/energy"][-1][-1]), 1e-9)

    def test_a_resumed_run_has_the_same_bits(self):
        self.pull("pulled", 1.0, 0.01)
        with self.solve("pulled") as file:
            whole = {n: file[n][()].tobytes() for n in ("history/bolt_force", "history/energy")}
            slip = file["frames/bolt_slip"][-1].tobytes()
            steps = len(file["history/time"])
        outcome = self.run_program("run", "pulled.nml", "--force", "--steps", "50")
        self.assertEqual(outcome.code, 0, outcome.err)
        outcome = self.run_program("resume", "pulled.ckpt.h5", "--steps", str(steps - 50))
        self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("pulled.h5")) as file:
            for name in ("history/bolt_force", "history/energy"):
                self.assertEqual(file[name][()].tobytes(), whole[name], name)
            self.assertEqual(file["frames/bolt_slip"][-1].tobytes(), slip)

    def test_check_names_bolts_that_look_wrong(self):
        bolts = (
            "&bolt name = 'inside', from = -0.5, 0, to = -0.2, 0.1, {0} /\n"
            "&bolt name = 'away', kind = 'end_anchored', from = 5, 5, to = 6, 6, diameter = 0.02, young = 2e11 /\n"
            "&bolt name = 'blind', from = -0.25, 0, to = 0.5, 0, {0} /\n"
        ).format(GLASS.replace("0, 0.5", "0, 0.01"))
        self.make("odd", [(-0.5, -0.5, 0.0, 0.5), (0.0, -1.0, 1.0, 1.0)], bolts)
        told = self.run_program("check", "odd.nml").err
        self.assertIn("odd.nml:5:1: warning: bolt 'inside' crosses no joint", told)
        self.assertIn("odd.nml:6:1: warning: bolt 'away' lies outside the rock", told)
        self.assertIn("odd.nml:7:1: warning: bolt 'blind' has its head on no free face", told)
        self.assertNotIn("'inside' has its head", told)

    def test_what_is_missing_is_told(self):
        ends = "from = -0.5, 0, to = 0.5, 0"
        for text, words in [
            (f"{ends}, kind = 'grouted', area = 1", "'young' is missing"),
            (f"{ends}, kind = 'yielding', area = 1, young = 1", "'plateau_force' is missing"),
            (f"{ends}, stiffness = 1, young = 1", "a spring has 'stiffness'"),
            (f"{ends}, {GLASS}, element = 1e-9", "'element' gives more than 10000 nodes"),
            (f"{ends}, kind = 'end_anchored', area = 1, young = 1, stroke = 1", "belong to kind 'yielding'"),
            ("along = 0, 0, 1, 1, kind = 'end_anchored', area = 1, young = 1, length = 1", "a pattern needs 'spacing'"),
        ]:
            self.write("bad.nml", f"&bolt {text} /\n")
            self.assertIn(words, self.run_program("check", "bad.nml").err)
        dense = "&bolt along = -1, 0, 1, 0, spacing = 1e-6, length = 1, kind = 'end_anchored', area = 1, young = 1 /\n"
        self.hang("mid", 0.0, stages=dense)
        self.assertIn("&bolt: spacing gives more than 2000 bolts", self.run_program("check", "mid.nml").err)
        self.hang("mid", 0.0, stages="&stage install = 'b9', until_step = 3 /\n")
        self.assertIn("there is no &bolt 'b9'", self.run_program("check", "mid.nml").err)

    def test_a_pattern_stands_on_the_side_of_the_rock(self):
        bolts = "&bolt name = 'roof', along = {}, spacing = 1, length = 2, {} /\n"
        steel = "kind = 'end_anchored', diameter = 0.02, young = 2e11"
        for along in ("-2, 0, 2, 0", "2, 0, -2, 0"):
            groups = FIXED.format(-3, 3, 3, 3) + bolts.format(along, steel) + "&stage until_step = 1 /\n"
            self.make("roof", [(-3.0, 0.0, 3.0, 1.0), (-3.0, 1.0, 3.0, 3.0)], groups)
            with self.solve("roof") as file:
                self.assertEqual(file["model/bolt_names"][()].tolist(), [f"roof {i}".encode() for i in range(1, 5)])
                nodes = file["frames/bolt_node"][0]
            self.assertEqual(sorted(nodes[::2, 0].tolist()), [-1.5, -0.5, 0.5, 1.5])
            self.assertEqual(nodes[1::2, 1].tolist(), [2.0] * 4)

    def test_rock_over_the_line_does_not_turn_a_bolt(self):
        """A block reaches 0.1 m below the line at the second head, its neighbour ends 0.1 m above it."""
        bolts = (
            "&bolt name = 'roof', along = -2, 0, 2, 0, spacing = 1, length = 2, kind = 'grouted', diameter = 0.02, "
            "young = 2e11, grout_stiffness = 1e8, grout_strength = 1e5, plate_strength = 1e5 /\n"
        )
        groups = FIXED.format(-3, 3, 3, 3) + bolts + "&stage until_step = 1 /\n"
        boxes = [(-3.0, 0.0, -1.0, 3.0), (-1.0, -0.1, 0.0, 3.0), (0.0, 0.1, 1.0, 3.0), (1.0, 0.0, 3.0, 3.0)]
        for line in ("-2, 0, 2, 0", "2, 0, -2, 0"):
            self.make("roof", boxes, groups.replace("-2, 0, 2, 0", line))
            with self.solve("roof") as file:
                first = file["model/bolt_first"][()]
                nodes = file["frames/bolt_node"][0]
            self.assertEqual(nodes[first[:-1], 1].tolist(), [0.0] * 4)
            self.assertEqual(nodes[first[1:] - 1, 1].tolist(), [2.0] * 4)

    def test_a_pattern_around_a_region(self):
        """Bolts go out from the room that a later stage takes out, and those of the roof lose what is excavated."""
        still = "&stage until = 'equilibrium', tolerance = 1e-5"
        groups = FIXED.format(-3, 4, 3, 4) + "&region name = 'room', box = -1, 0, 1, 2 /\n"
        groups += "&region name = 'top', box = -1, 2, 1, 4 /\n"
        groups += (
            "&bolt name = 'ring', outline = 'room', spacing = 1, length = 1.5, kind = 'end_anchored', "
            "diameter = 0.02, young = 2e11 /\n"
        )
        groups += (
            f"{still} /\n{still}, excavate = 'room', install = 'ring' /\n&stage until_step = 99, excavate = 'top' /\n"
        )
        boxes = [(-3.0, -2.0, 3.0, 0.0), (-3.0, 0.0, -1.0, 4.0), (1.0, 0.0, 3.0, 4.0), (-1.0, 2.0, 1.0, 4.0)]
        boxes += [(-1.0, 0.0, 0.0, 2.0), (0.0, 0.0, 1.0, 2.0)]
        self.make("ring", boxes, groups + "&boundary along = -3, -2, 3, -2, kind = 'fixed' /\n", gravity=10)
        told = self.run_program("check", "ring.nml").err
        self.assertEqual(self.run_program("check", "ring.nml", "--json").json["model"]["bolts"], 8)
        self.assertIn("stage 3 takes out rock around 2 bolts, which lose that part and go on with the rest", told)
        self.assertNotIn("no free face", told)
        with self.solve("ring") as file:
            stage = file["frames/step"][()]
            nodes = file["frames/bolt_node"][-1].reshape(-1, 2, 2)
            heads = sorted(map(tuple, nodes[:, 0].round(2).tolist()))
            self.assertEqual(len(heads), 8)
            self.assertEqual(heads[0], (-1.0, 0.5))
            toes = nodes[:, 1]
            out = (abs(toes[:, 0]) > 2) | (toes[:, 1] < -1) | (toes[:, 1] > 3)
            self.assertTrue(out.all(), toes)
            states = file["frames/bolt_state"][-1].reshape(-1, 2)[:, 0]
            self.assertEqual(sorted(states.tolist()), [0, 0] + [1] * 6)
            self.assertGreater(len(stage), 2)


if __name__ == "__main__":
    unittest.main()
