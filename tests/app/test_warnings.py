# SPDX-License-Identifier: MIT
"""What a run says at its end about energy that came from nowhere and about time that it did not compute."""

import math
import unittest
from pathlib import Path

from support import ProgramTest, h5py

ROOT = Path(__file__).resolve().parents[2]

# A block falls 0.05 onto a base. With a closing tolerance of 0.005 w0 the contact closes with an overlap: its spring
# gives energy that nothing has put into it.
GEOMETRY = """\
0.01
8 0
0
0
2
0
0
0
0 0 4 0 1
4 0 4 1 1
4 1 0 1 1
0 1 0 0 1
1 1.05 1 2.05 1
1 2.05 3 2.05 1
3 2.05 3 1.05 1
3 1.05 1 1.05 1
0.5 0.5 0.5 0.5
3.5 0.5 3.5 0.5
"""
ANALYSIS = """\
1 40 1 1 0.02 0.01
1e8
0 0
1000 9810 1e8 0.2  0 0 0  0 0 0  0 0 0
30 0 0
"""
STRIKES = "where blocks end may depend on the time step more than the estimated time error says"


class WarningsTest(ProgramTest):
    def warnings(self, outcome):
        """The beginnings of the warnings in the summary."""
        messages = outcome.json["messages"]
        return [m["message"].split(":")[0] for m in messages if m["severity"] == "warning"]


@unittest.skipIf(h5py is None, "h5py is missing")
class EnergyFromNowhere(WarningsTest):
    def setUp(self):
        super().setUp()
        self.write("fall.dc", GEOMETRY)
        self.write("fall.df", ANALYSIS)
        self.write("late.nml", "&contact preset = 'dda_windows', close_tolerance = 0.005 /\n")

    def test_a_sound_run_passes(self):
        outcome = self.run_program("run", "fall.dc", "fall.df", "--strict", "--json")
        # but the block rebounds, by other heights with other steps
        self.assertEqual((outcome.code, self.warnings(outcome)), (0, [STRIKES]), outcome.err)
        given = outcome.json["energy_given"]
        self.assertGreater(given["compared_with"], 0)
        # a hundredth of what is accepted
        self.assertLess(max(given["discarded"], given["geometry"]), 1e-5 * given["compared_with"])

    def test_false_energy_is_reported_once(self):
        outcome = self.run_program("run", "fall.dc", "fall.df", "--config", "late.nml")
        self.assertEqual(outcome.code, 0)
        for text in (outcome.out, outcome.err, self.path("fall.log").read_text()):
            self.assertEqual(text.count("energy from nowhere"), 1, text)
            self.assertRegex(text, r"'discarded' gave .* where block 2 meets block 1 at \(1, 0\.99")
        outcome = self.run_program("run", "fall.dc", "fall.df", "--config", "late.nml", "--json", "--force")
        energy, step = [m["message"] for m in outcome.json["messages"] if m["severity"] == "warning"]
        self.assertIn("energy from nowhere", energy)
        # the block bounces on what was given: it is at -0.0118 with this step, at -0.0163 and 0.0018 with 1/2 and 1/4
        self.assertIn("may depend on the time step", step)

    def test_quiet_prints_no_warning(self):
        command = ("run", "fall.dc", "fall.df", "--config", "late.nml", "--quiet")
        outcome = self.run_program(*command)
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        self.assertNotIn("warning", outcome.out)
        self.assertIn("done: 40 steps", outcome.out)
        self.assertEqual(self.path("fall.log").read_text().count("warning: "), 2)
        # the JSON summary has all messages, --quiet or not
        self.assertEqual(self.run_program(*command, "--json", "--force").json["warnings"], 2)

    def test_strict_ends_the_run_and_keeps_its_results(self):
        self.write("strict.nml", "&contact preset = 'dda_windows', close_tolerance = 0.005 /\n&run strict = .true. /\n")
        for more in (("--config", "late.nml", "--strict"), ("--config", "strict.nml")):
            outcome = self.run_program("run", "fall.dc", "fall.df", *more, "--json", "--force")
            self.assertEqual(outcome.code, 3)
            steps = outcome.json["steps"]
            self.assertTrue(0 < steps < 40)
            with h5py.File(self.path("fall.h5"), "r") as file:
                self.assertEqual(len(file["history/step"]), steps)
                self.assertEqual(file["frames/step"][-1], steps)
                self.assertTrue(file.attrs["exit_reason"].startswith("failed: energy from nowhere"))
        # the checkpoint is an older one: the same steps come to the same end, or pass without --strict
        self.assertEqual(self.run_program("resume", "fall.ckpt.h5", "--strict").code, 3)
        outcome = self.run_program("resume", "fall.ckpt.h5", "--json")
        self.assertEqual((outcome.code, outcome.json["steps"]), (0, 40))
        self.assertIn("energy from nowhere", outcome.out)

    def test_what_was_given_before_a_stop_is_not_forgotten(self):
        whole = self.run_program("run", "fall.dc", "fall.df", "--config", "late.nml", "--json")
        self.run_program("run", "fall.dc", "fall.df", "--config", "late.nml", "--steps", "25", "--force")
        outcome = self.run_program("resume", "fall.ckpt.h5", "--steps", "15", "--json")
        self.assertEqual(outcome.json["energy_given"], whole.json["energy_given"])
        self.assertIn("energy from nowhere", outcome.out)


@unittest.skipIf(h5py is None, "h5py is missing")
class ShortRun(WarningsTest):
    def setUp(self):
        super().setUp()
        self.write("fall.dc", GEOMETRY)
        # g2 so small that each step may fall by 1e-5 only
        self.write("slow.df", ANALYSIS.replace("0.02", "0.00001"))
        self.write("fall.df", ANALYSIS)

    def test_a_run_that_went_nowhere_says_so(self):
        outcome = self.run_program("run", "fall.dc", "slow.df", "--json")
        self.assertEqual(outcome.code, 0)
        self.assertAlmostEqual(outcome.json["planned_time"], 0.4)
        self.assertAlmostEqual(outcome.json["done_share"], outcome.json["time"] / 0.4)
        self.assertLess(outcome.json["done_share"], 0.5)
        self.assertGreater(outcome.json["cuts"]["displacement"], 0)
        self.assertEqual(outcome.json["cuts"]["contacts"], 0)
        self.assertIn("of the planned time was computed: 40 steps ended at time", outcome.out)
        outcome = self.run_program("run", "fall.dc", "slow.df", "--force")
        for text in (outcome.out, outcome.err, self.path("slow.log").read_text()):
            self.assertRegex(text, r"instead of 0\.4\. Steps were cut \d+ times because a vertex would have moved")
        with h5py.File(self.path("slow.h5"), "r") as file:
            self.assertAlmostEqual(float(file.attrs["planned_time"]), 0.4)

    def test_counts_survive_a_stop(self):
        whole = self.run_program("run", "fall.dc", "slow.df", "--json").json
        self.run_program("run", "fall.dc", "slow.df", "--steps", "15", "--force")
        rest = self.run_program("resume", "slow.ckpt.h5", "--steps", "25", "--json").json
        for name in ("cuts", "short_steps", "planned_time", "done_share"):
            self.assertEqual(rest[name], whole[name], name)

    def test_a_run_to_its_time_says_nothing(self):
        # at 0.2 it is in the air after its first rebound, 10 % and 37 % lower than with 1/2 and 1/4 of the step.
        # This is said, and nothing of its time
        for more in ((), ("--t-end", "0.35")):
            outcome = self.run_program("run", "fall.dc", "fall.df", *more, "--json", "--force")
            self.assertEqual((outcome.code, self.warnings(outcome)), (0, [STRIKES]), outcome.out)
        self.assertEqual(outcome.json["done_share"], 1)


@unittest.skipIf(h5py is None, "h5py is missing")
class ErrorInTime(ProgramTest):
    """A block under one pulse of the base, with steps that are twenty times as long as its own."""

    def setUp(self):
        super().setUp()
        folder = ROOT / "inputs" / "shaking_block"
        self.files = [str(folder / f"shaking_block.{ending}") for ending in ("dc", "df")]
        base = f"&load base_acceleration = '{folder / 'pulse.csv'}' /\n&run t_end = 1 /\n"
        self.write("usual.nml", base)
        self.write("long.nml", base + "&time dt_max = 0.04 /\n")

    def test_long_steps_are_warned_of(self):
        outcome = self.run_program("run", *self.files, "-o", "long.h5", "--config", "long.nml")
        self.assertEqual(outcome.code, 0)
        # they slide by 10.5 % less than steps of g1/16
        for text in (outcome.out, outcome.err, self.path("long.log").read_text()):
            self.assertEqual(text.count("the answer may depend on the time step: estimated time error 0.1"), 1, text)
            self.assertEqual(text.count(" no damping_ratio: springs vibrate, which shorter steps make no better"), 1)
        outcome = self.run_program("run", *self.files, "-o", "usual.h5", "--config", "usual.nml", "--json")
        self.assertEqual((outcome.code, outcome.json["warnings"]), (0, 0))
        with h5py.File(self.path("usual.h5"), "r") as file:
            errors = file["history/time_error"][:]
        self.assertEqual(outcome.json["time_error"], errors[-1])
        # steps of g1/16 slide by 0.43 % more
        self.assertTrue(0.0025 < errors[-1] < 0.01, errors[-1])

    def test_motion_after_strikes_is_warned_of(self):
        """Five blocks fall on a slope of 30 degrees, from 0.3 above it, and slide on with 20 degrees of friction."""
        way, height = math.radians(-30), 0.3

        def turned(*corners):
            turn = complex(math.cos(way), math.sin(way))
            return [turn * complex(*corner) for corner in corners]

        boxes = [turned((-2, -2), (60, -2), (60, 0), (-2, 0))]
        for k in range(5):
            x, y = 2.5 * k, height
            boxes.append(turned((x, y), (x + 1, y), (x + 1, y + 0.5), (x, y + 0.5)))
        lines = [
            "rockdda-blocks 1",
            "e0 0.001",
            "blocks 6",
            "vertices 24",
            "fixed 2",
            "loading 0",
            "measured 0",
            "bolts 0",
        ]
        for k, box in enumerate(boxes, start=1):
            lines += [f"block {k} 1 4", *(f"{z.real!r} {z.imag!r} 1" for z in box)]
        lines += ["fixed_points", *(f"{z.real!r} {z.imag!r} 1" for z in boxes[0][:2])]
        self.write("hail.blk", "\n".join([*lines, "loading_points", "measured_points", "bolt_list", "end", ""]))
        self.write(
            "hail.nml",
            "&model geometry = 'hail.blk' /\n"
            "&block_material number = 1, density = 2500, young = 1e10, poisson = 0.2 /\n"
            "&joint_material number = 1, friction = 20, normal_stiffness = 1e10 /\n&load gravity = 9.81 /\n"
            "&time dt_max = 0.002 /\n&contact sliding_damping = 0 /\n"
            "&stage name = 'fall', kind = 'dynamic', duration = 1 /\n",
        )
        outcome = self.run_program("run", "hail.nml", "--json")
        self.assertEqual((outcome.code, outcome.json["warnings"], outcome.json["struck_blocks"]), (0, 1, 6))
        # they fall freely to the slope, where the impulse across it comes with that of friction, and slide on
        g, friction = 9.81, math.tan(math.radians(20))
        fall = math.sqrt(2 * height / (g * math.cos(way)))
        driving = g * (math.sin(-way) - friction * math.cos(way))
        after = driving * fall * (1 - fall) + 0.5 * driving * (1 - fall) ** 2
        whole = math.hypot(0.5 * g * math.sin(-way) * fall**2 + after, height)
        # the strike is counted at the start of its step, a hundredth of the time away
        self.assertAlmostEqual(outcome.json["motion_after_strikes"], after / whole, delta=0.04)
        self.assertIn("where blocks end may depend on the time step", outcome.err)
        self.assertIn("Joint material 1 has neither restitution nor damping_ratio", outcome.err)
        damped = self.path("hail.nml").read_text().replace("1e10 /\n&load", "1e10, damping_ratio = 0.5 /\n&load")
        self.write("damped.nml", damped)
        damped = self.run_program("run", "damped.nml")
        self.assertIn("may depend on the time step", damped.err)
        self.assertNotIn("Joint material", damped.err)
        self.assertIn("# 6 blocks struck others and then moved by up to", self.path("hail.log").read_text())
        self.run_program("run", "hail.nml", "-o", "part.h5", "--steps", "40", "--threads", "2")
        rest = self.run_program("resume", "part.ckpt.h5", "--t-end", "1", "--json").json
        for name in ("struck_blocks", "motion_after_strikes"):
            self.assertEqual(rest[name], outcome.json[name], name)

    def test_a_block_that_bounces_and_comes_back_is_warned_of(self):
        """A block falls 2 m on the ground. It rebounds, by other heights with other steps; with the step of the program
        it lies where it was struck at the end."""
        boxes = [((-5, -1), (5, -1), (5, 0), (-5, 0)), ((0, 2), (0.5, 2), (0.5, 2.5), (0, 2.5))]
        lines = ["rockdda-blocks 1", "e0 0.0001", "blocks 2", "vertices 8", "fixed 2", "loading 0", "measured 0"]
        lines.append("bolts 0")
        for k, box in enumerate(boxes, start=1):
            lines += [f"block {k} 1 4", *(f"{x} {y} 1" for x, y in box)]
        lines += ["fixed_points", "-4 -0.5 1", "4 -0.5 1", "loading_points", "measured_points", "bolt_list", "end", ""]
        self.write("drop.blk", "\n".join(lines))
        model = (
            "&model geometry = 'drop.blk' /\n"
            "&block_material number = 1, density = 2500, young = 1e10, poisson = 0.25 /\n"
            "&joint_material number = 1, friction = 30 /\n&load gravity = 9.81 /\n&run t_end = 3 /\n"
        )
        for option in ("", "&time dt_max = 4e-3 /\n", "&time dt_max = 2e-3 /\n"):
            with self.subTest(option=option):
                self.write("drop.nml", model + option)
                outcome = self.run_program("run", "drop.nml", "--json", "--force")
                self.assertEqual((outcome.code, outcome.json["struck_blocks"]), (0, 2))
                # and, where the step throws it, of energy from nowhere
                self.assertIn(outcome.json["warnings"], (1, 2))
                with h5py.File(self.path("drop.h5"), "r") as file:
                    height = file["frames/vertices"][:, 4:8, 1].mean(axis=1) - 0.25
                    landed = file["frames/time"][:] > 0.66
                if not option:
                    self.assertLess(abs(height[-1]), 0.02)
                # it was struck at most a step above the ground; frames need not see its highest place
                self.assertGreater(outcome.json["motion_after_strikes"], height[landed].max() / 2 - 0.02)
                self.assertIn("2 blocks struck others and then moved by up to", outcome.err)
        self.run_program("run", "drop.nml", "-o", "part.h5", "--steps", "200", "--threads", "2")
        rest = self.run_program("resume", "part.ckpt.h5", "--t-end", "3", "--json").json
        self.assertEqual(rest["motion_after_strikes"], outcome.json["motion_after_strikes"])

    def test_friction_that_turns_makes_estimates_too_small(self):
        """Steps of the program miss the sliding of a flat block under five shakes by half of the largest displacement;
        the estimate is 4 %. A block that does not slide has no warning."""
        lines = ["rockdda-blocks 1", "e0 0.0005", "blocks 2", "vertices 8", "fixed 2", "loading 0", "measured 0"]
        lines += ["bolts 0", "block 1 1 4", "-100 -5 1", "100 -5 1", "100 0 1", "-100 0 1"]
        lines += ["block 2 1 4", "0 0 1", "5 0 1", "5 2 1", "0 2 1", "fixed_points", "-95 -2.5 1", "95 -2.5 1"]
        self.write("flat.blk", "\n".join([*lines, "loading_points", "measured_points", "bolt_list", "end", ""]))
        for friction, expected in (
            (10, "may depend on the time step: .*, and where friction turns the error"),
            (40, ""),
        ):
            self.write(
                "flat.nml",
                "&model geometry = 'flat.blk' /\n&load gravity = 9.81, harmonic = 3, 0, 0.4, 0, 0 /\n"
                "&block_material number = 1, density = 2500, young = 2e11, poisson = 0.25 /\n"
                f"&joint_material number = 1, friction = {friction}, damping_ratio = 0.5 /\n"
                "&stage name = 'w', until = 'equilibrium' /\n&time integrator = 'generalized_alpha' /\n"
                "&stage name = 'q', kind = 'dynamic', duration = 12.7, reset_displacement = .true. /\n",
            )
            outcome = self.run_program("run", "flat.nml", "--force")
            self.assertEqual((outcome.code, outcome.err.count("warning")), (0, 1 if expected else 0), outcome.err)
            self.assertRegex(outcome.err, expected or "^$")

    def test_blocks_at_rest_have_no_error(self):
        """A block in equilibrium that nothing moves: what moves is rounding."""
        lines = ["rockdda-blocks 1", "e0 0.001", "blocks 2", "vertices 8", "fixed 2", "loading 0", "measured 0"]
        lines += ["bolts 0", "block 1 1 4", "-10 -1 1", "10 -1 1", "10 0 1", "-10 0 1"]
        lines += ["block 2 1 4", "-1 0 1", "0 0 1", "0 1 1", "-1 1 1", "fixed_points", "-9 -0.5 1", "9 -0.5 1"]
        self.write("rest.blk", "\n".join([*lines, "loading_points", "measured_points", "bolt_list", "end", ""]))
        for scheme in ("shi", "generalized_alpha"):
            self.write(
                "rest.nml",
                "&model geometry = 'rest.blk' /\n&load gravity = 9.81 /\n"
                "&block_material number = 1, density = 2500, young = 1e10, poisson = 0.2 /\n"
                "&joint_material number = 1, friction = 5, damping_ratio = 0.5 /\n"
                f"&time integrator = '{scheme}' /\n"
                "&stage until = 'equilibrium' /\n&stage kind = 'dynamic', duration = 1 /\n"
                "&change stage = 'stage 2', joint_material = 1, friction = 4 /\n",
            )
            outcome = self.run_program("run", "rest.nml", "--force")
            self.assertEqual((outcome.code, outcome.err), (0, ""))

    def test_control_of_steps_by_their_error_is_refused(self):
        """With its place, and with the program that measures what the step changes."""
        self.write("gone.nml", "&time\n  accuracy = 1e-3\n/\n")
        for command in ("run", "check"):
            outcome = self.run_program(command, *self.files, "--config", "gone.nml")
            self.assertEqual(outcome.code, 2)
            self.assertRegex(outcome.err, r"gone\.nml:2:3: error: .*'accuracy' in &time; .*rockdda-post convergence")

    def test_threads_and_a_stop_change_nothing(self):
        rows = []
        for threads in ("1", "2"):
            self.run_program("run", *self.files, "-o", "a.h5", "--config", "long.nml", "--threads", threads, "--force")
            with h5py.File(self.path("a.h5"), "r") as file:
                rows.append(file["history/time_error"][:].tolist())
        self.run_program("run", *self.files, "-o", "a.h5", "--config", "long.nml", "--steps", "12", "--force")
        self.run_program("resume", "a.ckpt.h5", "--t-end", "1")
        with h5py.File(self.path("a.h5"), "r") as file:
            rows.append(file["history/time_error"][:].tolist())
        self.assertGreater(rows[0][-1], 0.05)
        self.assertEqual(rows[0], rows[1])
        self.assertEqual(rows[0], rows[2])


if __name__ == "__main__":
    unittest.main()
