# SPDX-License-Identifier: MIT
"""Sliding on a base that shakes against the rigid block of Newmark (1965), whatever the step."""

import math
import unittest

from support import ProgramTest

try:
    import h5py
    import numpy as np
except ImportError:
    h5py = None

G = 9.81
ANGLE, FRICTION, FREQUENCY, STRENGTH, DURATION = 20.0, 26.0, 4.0, 1.5, 0.7


def turned(points):
    c, s = math.cos(math.radians(ANGLE)), math.sin(math.radians(ANGLE))
    return [(c * x - s * y, s * x + c * y) for x, y in points]


def slip_of_a_rigid_block(times, along):
    """Down a plane that rises towards +x, on a base that moves with this horizontal acceleration."""
    s, c = math.sin(math.radians(ANGLE)), math.cos(math.radians(ANGLE))
    fine = np.linspace(0, times[-1], 100001)
    a = np.interp(fine, times, along)
    net = (G * s + a * c - math.tan(math.radians(FRICTION)) * (G * c - a * s)) * (fine[1] - fine[0])
    speed = slip = 0.0
    for change in net:
        after = max(0.0, speed + change)
        slip += 0.5 * (speed + after) * (fine[1] - fine[0])
        speed = after
    return slip


@unittest.skipUnless(h5py, "needs h5py")
class Newmark(ProgramTest):
    def setUp(self):
        super().setUp()
        base = turned([(-3, -1), (3, -1), (3, 0), (-3, 0)])
        block = turned([(-1, 0), (1, 0), (1, 1), (-1, 1)])
        held = turned([(-2.9, -0.9), (2.9, -0.9), (2.9, -0.1), (-2.9, -0.1)])
        lines = ["rockdda-blocks 1", "e0 0.0001", "blocks 2", "vertices 8", "fixed 4", "loading 0", "measured 0"]
        lines += ["bolts 0", "block 1 1 4", *(f"{x!r} {y!r} 1" for x, y in base)]
        lines += ["block 2 1 4", *(f"{x!r} {y!r} 1" for x, y in block)]
        lines += ["fixed_points", *(f"{x!r} {y!r} 1" for x, y in held)]
        lines += ["loading_points", "measured_points", "bolt_list", "end"]
        self.write("m.blk", "\n".join(lines) + "\n")
        tangent = math.tan(math.radians(FRICTION))
        s, c = math.sin(math.radians(ANGLE)), math.cos(math.radians(ANGLE))
        yields = G * (tangent * c - s) / (c + tangent * s)
        times = np.linspace(0, DURATION, 401)
        shaken = np.sin(2 * math.pi * FREQUENCY * times) * (times * FREQUENCY < 2)
        along = STRENGTH * yields * shaken
        self.write("a.csv", "t,ax,ay\n" + "".join(f"{t:.6f},{a:.9g},0\n" for t, a in zip(times, along, strict=True)))
        self.truth = slip_of_a_rigid_block(times, along)

    def slip(self, step, contact="", joint=""):
        self.write(
            "m.nml",
            "&model geometry = 'm.blk' /\n"
            "&block_material number = 1, density = 2500, young = 2e10, poisson = 0.25 /\n"
            f"&joint_material number = 1, friction = {FRICTION}{joint} /\n"
            "&load gravity = 9.81, base_acceleration = 'a.csv' /\n"
            f"&time dt_max = {step} /\n&contact {contact} /\n&run save_every = 1000000 /\n"
            "&stage name = 'weight', until = 'equilibrium' /\n"
            f"&stage name = 'shaking', kind = 'dynamic', duration = {DURATION}, reset_displacement = .true. /\n",
        )
        outcome = self.run_program("run", "m.nml", "-o", "out.h5", "--force")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.said = outcome.err + self.path("out.log").read_text()
        with h5py.File(self.path("out.h5")) as file:
            moved = file["frames/vertices"][-1] - file["frames/vertices"][0]
        return math.hypot(*(moved[4:8].mean(0) - moved[:4].mean(0)))

    def test_shorter_steps_slide_no_further(self):
        """Without damping of contacts that slide 0.01, 0.77 and 2.34 more than the rigid block."""
        misses = [abs(self.slip(step) / self.truth - 1) for step in (2e-3, 5e-4, 2e-4)]
        self.assertTrue("contacts that slide in dynamic stages have 0.5 of critical damping" in self.said)
        # of a slip of some millimetres the shear springs take up to 2 %
        self.assertLess(max(misses), 0.02, misses)
        self.assertLess(misses[1], misses[0] + 0.005)
        self.assertLess(misses[2], misses[1] + 0.005)

    def test_rebound_by_springs_is_noted(self):
        note = "rebound by the springs of joints without restitution, by a speed that depends on the time step"
        self.slip(2e-3)
        self.assertTrue(note in self.said)
        self.slip(2e-3, joint=", restitution = 0")
        self.assertFalse(note in self.said)

    def test_what_is_given_holds(self):
        undamped = self.slip(5e-4, contact="sliding_damping = 0")
        self.assertFalse("contacts that slide in dynamic stages" in self.said)
        self.assertNotEqual(undamped, self.slip(5e-4))
        # a joint with damping has its own
        own = [self.slip(5e-4, contact=words, joint=", damping_ratio = 0.2") for words in ("", "sliding_damping = 0")]
        self.assertEqual(own[0], own[1])


if __name__ == "__main__":
    unittest.main()
