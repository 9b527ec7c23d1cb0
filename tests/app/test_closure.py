# SPDX-License-Identifier: MIT
"""Joints that stiffen as they close (maximum_closure): closed forms, energy, and what is refused."""

import math
import unittest

from support import ProgramTest, h5py

STIFFNESS, LARGEST = 1e9, 5e-5
MODEL = """\
&model geometry = '{name}.blk', units = 'none' /
&block_material number = 1, density = 2500, young = 1e13, poisson = 0 /
&joint_material number = 1, name = 'joint', {joint} /
&load gravity = {gravity} /
"""
JOINT = "friction = 40, normal_stiffness = 1e9, shear_stiffness = 1e9, maximum_closure = 5e-5"
REST = "&stage until = 'equilibrium', tolerance = 1e-9 /\n"


def integral(u):
    """Of the energy over vm^2, -u - ln(1 - u)."""
    return u - u * u / 2 + (1 - u) * math.log(1 - u)


@unittest.skipUnless(h5py, "needs h5py")
class Closure(ProgramTest):
    def make(self, name, heights, groups, gravity=9.81, joint=JOINT):
        """Blocks 1 m wide, one on the other, on a fixed base."""
        blocks, low = [[(-1, -1), (2, -1), (2, 0), (-1, 0)]], 0
        for height in heights:
            blocks.append([(0, low), (1, low), (1, low + height), (0, low + height)])
            low += height
        text = f"rockdda-blocks 1\ne0 0.001\nblocks {len(blocks)}\nvertices {4 * len(blocks)}\n"
        text += "fixed 0\nloading 0\nmeasured 0\nbolts 0\n"
        for number, block in enumerate(blocks, start=1):
            text += f"block {number} 1 4\n" + "".join(f"{x} {y} 1\n" for x, y in block)
        self.write(f"{name}.blk", text + "fixed_points\nloading_points\nmeasured_points\nbolt_list\nend\n")
        groups += "&boundary along = -1, -1, 2, -1, kind = 'fixed' /\n"
        self.write(f"{name}.nml", MODEL.format(name=name, joint=joint, gravity=gravity) + groups)

    def solve(self, name, *arguments, code=0):
        outcome = self.run_program("run", f"{name}.nml", "--force", *arguments)
        self.assertEqual(outcome.code, code, outcome.err)
        return h5py.File(self.path(f"{name}.h5"))

    def openings(self, file):
        """Of the two ends of each joint, from below."""
        first, end = file["frames/contact_offset"][-2:]
        return file["frames/contact_opening"][first:end].reshape(-1, 2)

    def test_column(self):
        """Each joint by the weight above it, however long the way there: from 2 % to 99 % of the largest closure."""
        for factor in (0.05, 1, 3, 100):
            heights = [1.0, 2.0, 1.5]
            self.make("column", heights, REST, gravity=9.81 * factor)
            with self.solve("column") as file:
                for k, opening in enumerate(self.openings(file)):
                    stress = 2500 * 9.81 * factor * sum(heights[k:])
                    closure = stress / (STIFFNESS + stress / LARGEST)
                    for end in opening:
                        self.assertAlmostEqual(-end, closure, delta=1e-8 * closure)
                self.assertLess(file["history/open_close_iterations"][()].max(), 10)

    def test_load_beside_the_middle(self):
        """The force that closes both ends by given parts of the largest closure, at its place."""
        for u in [(0.3, 0.5), (0.1, 0.9), (0.9, 0.97), (0.0, 0.8), (-0.2, 0.6), (-0.5, 0.99)]:
            low = max(u[0], 0.0)
            length = (u[1] - low) / (u[1] - u[0])
            # force and moment about the end that is closed less: both follow from the integral of 1/(1 - u)
            spread = u[1] - low
            force = math.log((1 - low) / (1 - u[1])) / spread - 1
            moment = ((1 - low) * math.log((1 - low) / (1 - u[1])) / spread - 1) / spread - 0.5
            place = 1 - length + length * moment / force
            force *= STIFFNESS * LARGEST * length
            load = f"&loading_point at = {place!r}, 0.2, force = 0, {-force!r} /\n"
            self.make("beside", [0.2], load + REST, gravity=0)
            with self.solve("beside") as file:
                (ends,) = self.openings(file)
                # the block turns by up to 7e-5, and moves the load
                for end, share in zip(ends, u, strict=True):
                    self.assertAlmostEqual(-end, share * LARGEST, delta=3e-4 * LARGEST)

    def test_sudden_weight(self):
        """The work of the weight down to the deepest closure is the energy of the joint there; it comes back."""
        weight = 2500 * 9.81
        low, high = 0.0, 1 - 1e-9
        for _ in range(100):
            u = (low + high) / 2
            work = STIFFNESS * LARGEST * (-u - math.log(1 - u))
            low, high = (u, high) if work < weight * u else (low, u)
        # the base gives way by 0.3 % of it
        for integrator in ("generalized_alpha", "shi"):
            groups = f"&time dt_max = 1e-5, integrator = '{integrator}', rho_infinity = 1 /\n"
            self.make("sudden", [1.0], groups + "&stage kind = 'dynamic', duration = 0.005 /\n")
            with self.solve("sudden", "--save-every", "1") as file:
                deepest = max(-self.opening_of(file, frame) for frame in range(1, len(file["frames/time"])))
                self.assertAlmostEqual(deepest, u * LARGEST, delta=5e-3 * u * LARGEST)
                self.assertLess(abs(file["history/energy"][:, -1]).max(), 1e-12)

    def opening_of(self, file, frame):
        first, end = file["frames/contact_offset"][frame : frame + 2]
        return file["frames/contact_opening"][first:end].mean() if end > first else 0.0

    def test_friction(self):
        """tan(phi) times the force of the joint, which is closed more at the end that is pushed down."""
        weight = 2500 * 9.81
        for share, state in ((0.95, 2), (1.2, 1)):
            push = share * math.tan(math.radians(40)) * weight
            load = f"&loading_point at = 0, 0.2, force = {push!r}, 0 /\n"
            stage = REST if state == 2 else "&run t_end = 0.05 /\n&time k01 = 0, dt_max = 1e-3 /\n"
            self.make("friction", [1.0], load + stage)
            with self.solve("friction") as file:
                first, end = file["frames/contact_offset"][-2:]
                self.assertEqual(set(file["frames/contact_state"][first:end]), {state})
                force = file["frames/contact_force"][first:end].sum(axis=0)
                if state == 1:
                    self.assertAlmostEqual(abs(force[0] / force[1]), math.tan(math.radians(40)), delta=1e-5)

    def test_resumed(self):
        groups = "&time dt_max = 1e-4 /\n&stage kind = 'dynamic', duration = 0.01 /\n"
        groups += "&loading_point at = 0, 0.9, force = 6e3, 0 /\n"
        self.make("whole", [1.0, 0.7], groups)
        with self.solve("whole", "--steps", "60") as file:
            whole = file["history/energy"][()], file["frames/centroid"][-1]
        outcome = self.run_program("run", "whole.nml", "-o", "part.h5", "--force", "--steps", "25")
        self.assertEqual(outcome.code, 0, outcome.err)
        outcome = self.run_program("resume", "part.ckpt.h5", "--steps", "35")
        self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("part.h5")) as file:
            self.assertTrue((file["history/energy"][()] == whole[0]).all())
            self.assertTrue((file["frames/centroid"][-1] == whole[1]).all())

    def test_refused(self):
        for joint, groups, message in [
            ("friction = 40, maximum_closure = 1e-4", "", "maximum_closure needs normal_stiffness"),
            (JOINT + ", restitution = 0.5", "", "maximum_closure and restitution exclude each other"),
            (JOINT + ", tie = .true.", "", "maximum_closure and tie = .true. exclude each other"),
            (
                JOINT,
                "&change stage = 'a', joint_material = 'joint', normal_stiffness = 2e9 /\n"
                "&stage name = 'a', until = 'equilibrium' /\n",
                "the normal_stiffness of a joint with maximum_closure cannot change with a stage",
            ),
            (
                JOINT,
                "&liner along = 0, 1, 1, 1, thickness = 0.1, young = 1e9, joint_material = 'joint' /\n",
                "the joint of a lining has a constant stiffness",
            ),
        ]:
            self.make("refused", [1.0], groups + (REST if "&stage" not in groups else ""), joint=joint)
            outcome = self.run_program("run", "refused.nml", "--force")
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn(message, " ".join(outcome.err.split()))
            self.assertRegex(outcome.err, r"refused\.nml:\d+:\d+")


if __name__ == "__main__":
    unittest.main()
