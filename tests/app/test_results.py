# SPDX-License-Identifier: MIT
"""What `rockdda run` leaves in the results file: every dataset and attribute."""

import itertools
import unittest

from results_case import ENERGY_COLUMNS, INPUTS, ResultsTest
from support import GEOMETRY, h5py

if h5py is not None:
    import numpy as np

REAL, INTEGER = "<f8", "<i4"

# The block of GEOMETRY gets a material of its own, which rises with initial stress.
TWO_MATERIALS = GEOMETRY.replace("0           # material lines", "1           # material lines").replace(
    "0.5 0.5 0.5 0.5\n", "1.2 1.5 1.8 1.5 2\n0.5 0.5 0.5 0.5\n"
)
RISING = """\
1 6 2 1 0.05 0.01
1000 9810 1e8 0.2   0 0 0  0 0 0  0 0 0
2000 19620 1e8 0.2  -100 -200 30  10 20 -4  0.1 1.5 0
30 0 0
"""


def distance(point, corners):
    """Distance of a point from an outline."""
    along = np.roll(corners, -1, axis=0) - corners
    share = np.clip(((point - corners) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return np.hypot(*(corners + share[:, None] * along - point).T).min()


class Layout(ResultsTest):
    """Names, shapes and types, and how the tables fit together."""

    def check(self, *arguments, fixed, loading, measured, save_every, bolts=0, vertices=False):
        data, attributes = self.run_model(*arguments, "--save-every", str(save_every))
        nb = len(data["model/block_material"])
        nv = len(data["model/vertices"])
        ns = len(data["history/step"])
        nk = len(data["frames/step"])
        total = len(data["frames/contact_state"])
        self.assertGreater(min(nb, nv, ns, nk, total), 0)
        expected = {
            "model/vertex_offset": ((nb + 1,), INTEGER),
            "model/vertices": ((nv, 2), REAL),
            "model/edge_joint": ((nv,), INTEGER),
            "model/block_material": ((nb,), INTEGER),
            "model/block_area": ((nb,), REAL),
            "model/block_centroid": ((nb, 2), REAL),
            "model/fixed_points": ((fixed, 2), REAL),
            "model/loading_points": ((loading, 2), REAL),
            "model/measured_points": ((measured, 2), REAL),
            "model/bolt_ends": ((bolts, 2, 2), REAL),
            "model/bolt_blocks": ((bolts, 2), INTEGER),
            "model/bolt_properties": ((bolts, 3), REAL),
            "history/step": ((ns,), INTEGER),
            "history/time": ((ns,), REAL),
            "history/dt": ((ns,), REAL),
            "history/open_close_iterations": ((ns,), INTEGER),
            "history/attempts": ((ns,), INTEGER),
            "history/solver_iterations": ((ns,), INTEGER),
            "history/contacts": ((ns, 3), INTEGER),
            "history/max_displacement": ((ns,), REAL),
            "history/energy": ((ns, 10), REAL),
            "history/measured_displacement": ((ns, measured, 2), REAL),
            "history/measured_stress": ((ns, measured, 3), REAL),
            "history/measured_rotation": ((ns, measured), REAL),
            "history/fixed_force": ((ns, fixed, 2), REAL),
            "history/boundary_force": ((ns, 0, 2), REAL),
            "history/unbalanced": ((ns,), REAL),
            "history/stage": ((ns,), INTEGER),
            "history/relaxation": ((ns,), REAL),
            "history/time_error": ((ns,), REAL),
            "frames/step": ((nk,), INTEGER),
            "frames/time": ((nk,), REAL),
            "frames/vertices": ((nk, nv, 2), REAL),
            "frames/centroid": ((nk, nb, 2), REAL),
            "frames/rotation": ((nk, nb), REAL),
            "frames/stress": ((nk, nb, 3), REAL),
            "frames/velocity": ((nk, nb, 6), REAL),
            "frames/bolt_ends": ((nk, bolts, 2, 2), REAL),
            "frames/bolt_force": ((nk, bolts), REAL),
            "frames/active": ((nk, nb), INTEGER),
            "frames/contact_offset": ((nk + 1,), INTEGER),
            "frames/contact_point": ((total, 2), REAL),
            "frames/contact_force": ((total, 2), REAL),
            "frames/contact_state": ((total,), INTEGER),
            "frames/contact_blocks": ((total, 2), INTEGER),
            "frames/contact_opening": ((total,), REAL),
            "frames/contact_slip": ((total,), REAL),
            "frames/contact_length": ((total,), REAL),
            "frames/contact_normal_stress": ((total,), REAL),
            "frames/contact_shear_stress": ((total,), REAL),
            "frames/contact_strength": ((total,), REAL),
        }
        texts = ["input/analysis", "input/config", "input/geometry"]
        self.assertEqual(sorted(data), sorted([*expected, *texts, "model/stage_names"]))
        self.assertEqual([bytes(name) for name in data["model/stage_names"]], [b"stage 1"])
        for name, (shape, kind) in expected.items():
            self.assertEqual(data[name].shape, shape, name)
            self.assertEqual(data[name].dtype.newbyteorder("="), np.dtype(kind), name)
            self.assertTrue(np.isfinite(data[name]).all(), name)
        with h5py.File(self.path("out.h5"), "r") as file:
            for name, (_, kind) in expected.items():
                self.assertEqual(file[name].dtype.str, kind, name)
            for name in texts:
                self.assertEqual((file[name].shape, h5py.check_string_dtype(file[name].dtype).encoding), ((), "utf-8"))
        self.check_attributes(attributes)
        self.check_blocks(data, attributes)
        self.check_history(data)
        self.check_contacts(data, vertices)
        last = data["history/step"][-1]
        steps = sorted({*range(0, last + 1, save_every), last})
        self.assertEqual(data["frames/step"].tolist(), steps)
        return data, attributes

    def check_attributes(self, attributes):
        root = attributes["/"]
        names = ["complete", "created", "exit_reason", "format", "format_version", "planned_time", "program_version"]
        names += ["title", "units"]
        self.assertEqual(sorted(root), names)
        self.assertEqual((root["format"], root["format_version"]), ("rockdda", 2))
        self.assertEqual((root["complete"], root["exit_reason"]), (1, "finished"))
        self.assertRegex(root["created"], r"^20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        self.assertIn("rockdda " + root["program_version"] + "\n", self.run_program("--version").out)
        self.assertEqual(list(attributes["history/energy"]["columns"]), ENERGY_COLUMNS)

    def check_blocks(self, data, attributes):
        offset, vertices = data["model/vertex_offset"], data["model/vertices"]
        self.assertEqual((offset[0], offset[-1]), (0, len(vertices)))
        self.assertTrue((np.diff(offset) >= 3).all())
        for i, (first, last) in enumerate(itertools.pairwise(offset)):
            x, y = vertices[first:last].T
            cross = x * np.roll(y, -1) - np.roll(x, -1) * y
            area = cross.sum() / 2
            self.assertGreater(area, 0, "counter-clockwise")
            # the same sums in another order: rounding only, at coordinates below 100
            self.assertAlmostEqual(data["model/block_area"][i], area, delta=1e-12 * max(1, area))
            centre = [((p + np.roll(p, -1)) * cross).sum() / (6 * area) for p in (x, y)]
            self.assertLess(np.abs(data["model/block_centroid"][i] - centre).max(), 1e-11)
        for kind in ("fixed", "loading", "measured"):
            owners = attributes[f"model/{kind}_points"]["block"]
            points = data[f"model/{kind}_points"]
            self.assertEqual(owners.dtype.str, INTEGER)
            self.assertEqual(owners.shape, (len(points),))
            for owner, point in zip(owners, points, strict=True):
                corners = vertices[offset[owner] : offset[owner + 1]]
                self.assertTrue((corners.min(axis=0) <= point).all() and (point <= corners.max(axis=0)).all())
        # the start
        for name, start in (("vertices", "vertices"), ("centroid", "block_centroid")):
            self.assertTrue(np.array_equal(data["frames/" + name][0], data["model/" + start]), name)
        self.assertEqual((data["frames/step"][0], data["frames/time"][0]), (0, 0))
        self.assertFalse(data["frames/rotation"][0].any())

    def check_history(self, data):
        ns = len(data["history/step"])
        self.assertEqual(data["history/step"].tolist(), list(range(1, ns + 1)))
        # times are sums of the steps in this order
        self.assertTrue(np.array_equal(data["history/time"], np.cumsum(data["history/dt"])))
        self.assertTrue((data["history/attempts"] >= 1).all())
        self.assertTrue((data["history/open_close_iterations"] >= 1).all())
        rows = data["frames/step"][1:] - 1
        self.assertTrue(np.array_equal(data["frames/time"][1:], data["history/time"][rows]))

    def check_contacts(self, data, vertices):
        offset, state = data["frames/contact_offset"], data["frames/contact_state"]
        blocks, force, point = (data["frames/contact_" + k] for k in ("blocks", "force", "point"))
        self.assertEqual((offset[0], offset[-1]), (0, len(state)))
        self.assertTrue((np.diff(offset) >= 0).all())
        self.assertTrue(np.isin(state, [0, 1, 2]).all())
        self.assertFalse(force[state == 0].any(), "no force when open")
        self.assertTrue(((blocks >= 0) & (blocks < len(data["model/block_area"]))).all())
        self.assertTrue((blocks[:, 0] != blocks[:, 1]).all())
        slip, length, normal, shear = (
            data["frames/contact_" + k] for k in ("slip", "length", "normal_stress", "shear_stress")
        )
        self.assertTrue((length >= 0).all() and (slip >= 0).all())
        self.assertFalse(np.concatenate([normal[state == 0], shear[state == 0]]).any(), "no stress when open")
        # of both ends of a stretch, or of one corner, stress times length adds up to the force
        begins = np.zeros(len(state), bool)
        begins[offset[:-1][offset[:-1] < len(state)]] = True
        begins[1:] |= (blocks[1:] != blocks[:-1]).any(axis=1)
        starts = np.flatnonzero(begins)
        whole = np.column_stack([np.add.reduceat(part, starts) for part in (normal * length, shear * length)])
        expected = np.add.reduceat(np.where(length[:, None] > 0, force, 0), starts)
        # the normals at both ends differ by the angle of the edges
        np.testing.assert_allclose(np.hypot(*whole.T), np.hypot(*expected.T), rtol=0, atol=1e-5 * np.abs(force).max())
        first, opening = data["model/vertex_offset"], data["frames/contact_opening"]
        for k, step in enumerate(data["frames/step"]):
            rows = slice(offset[k], offset[k + 1])
            if step > 0:
                numbers = np.bincount(state[rows], minlength=3)
                self.assertEqual(numbers.tolist(), data["history/contacts"][step - 1].tolist())
            for pair, p, gap in zip(blocks[rows], point[rows], opening[rows], strict=True):
                corners = [data["frames/vertices"][k, first[b] : first[b + 1]] for b in pair]
                if vertices:
                    self.assertTrue((corners[0] == p).all(axis=1).any(), "a vertex of the first block")
                # the ends of stretches follow from points between them, which move with the blocks in a step: to the
                # second order of its rotation
                near = (1 + 1e-6) * abs(gap) + (1e-11 if vertices else 1e-6)
                self.assertLess(distance(p, corners[0]), near, "on the first block, or in the gap")
                self.assertLess(distance(p, corners[1]), near, "on the second block, or in the gap")

    def test_own_model(self):
        data, attributes = self.check("block.dc", "block.df", fixed=2, loading=1, measured=1, save_every=3)
        self.assertEqual(data["model/vertex_offset"].tolist(), [0, 4, 8])
        self.assertEqual(attributes["model/loading_points"]["block"].tolist(), [1])
        self.assertEqual(attributes["model/fixed_points"]["block"].tolist(), [0, 0])
        self.assertEqual(data["model/edge_joint"].tolist(), [1] * 8)

    def test_contacts_at_vertices(self):
        self.path("vertex.nml").write_text("&contact formulation = 'vertex' /\n")
        arguments = ("block.dc", "block.df", "--config", "vertex.nml")
        self.check(*arguments, fixed=2, loading=1, measured=1, save_every=3, vertices=True)

    def test_pushed_block(self):
        arguments = (INPUTS / "pushed_block", "--steps", "50")
        self.check(*arguments, fixed=4, loading=1, measured=1, save_every=20)

    def test_bolted_beam(self):
        arguments = (INPUTS / "bolted_beam", "--steps", "30")
        data, _ = self.check(*arguments, fixed=6, loading=0, measured=4, save_every=1, bolts=1)
        self.assertEqual(data["model/bolt_ends"].tolist(), [[[-2.5, 0.3], [2.5, 0.3]]])
        self.assertEqual(data["model/bolt_properties"].tolist(), [[1e7, 2e5, 0]])
        self.assertEqual(data["frames/bolt_force"][0].tolist(), [2e5], "the pretension")
        centres = data["model/block_centroid"][data["model/bolt_blocks"][0]]
        self.assertLess(np.abs(centres[:, 0] - [-2.5, 2.5]).max(), 1e-9, "the outer cubes")
        ends = data["frames/bolt_ends"][:, 0]
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        # the same difference in another order, of lengths of 5: rounding times the stiffness of 1e7
        self.assertLess(np.abs(data["frames/bolt_force"][:, 0] - (2e5 + 1e7 * (length - 5))).max(), 1e-7)

    def test_title_is_utf8_whatever_the_options_file_is(self):
        self.path("latin.nml").write_bytes("&run title = 'Böschung ü' /\n".encode("latin-1"))
        _, attributes = self.run_model("block.dc", "block.df", "--config", "latin.nml")
        self.assertEqual(attributes["/"]["title"], "Böschung ü")

    def test_open_contacts_and_input_state(self):
        self.write("block.dc", TWO_MATERIALS)
        self.write("block.df", RISING)
        data, _ = self.check("block.dc", "block.df", fixed=2, loading=1, measured=1, save_every=1)
        self.assertEqual(data["model/block_material"].tolist(), [1, 2])
        # sigma = s + t y at the centroid, y = 1.5
        self.assertTrue(np.array_equal(data["frames/stress"][0], [[0, 0, 0], [-85, -170, 24]]))
        self.assertTrue(np.array_equal(data["frames/velocity"][0], [[0] * 6, [0.1, 1.5, 0, 0, 0, 0]]))
        self.assertGreater((data["frames/contact_state"] == 0).sum(), 0)
        # nothing touches the rising block: its centroid is thrown, one rounding a step at coordinates of about 2
        t = data["frames/time"]
        path = np.column_stack([2 + 0.1 * t, 1.5 + 1.5 * t - 0.5 * 9.81 * t**2])
        self.assertLess(np.abs(data["frames/centroid"][:, 1] - path).max(), 1e-13)

    def test_measured_point_outside_all_blocks_is_left_out(self):
        text = GEOMETRY.replace("1           # measured", "2           # measured")
        self.write("block.dc", text.replace("2 1.5\n2 1.5\n", "2 1.5\n9 9\n2 1.5\n"))
        outcome = self.run_program("run", "block.dc", "block.df", "-o", "warned.h5")
        self.assertIn("block.dc:19:1: warning: ", outcome.err)
        data, attributes = self.run_model("block.dc", "block.df")
        self.assertEqual(data["model/measured_points"].tolist(), [[2, 1.5]])
        self.assertEqual(attributes["model/measured_points"]["block"].tolist(), [1])
        self.assertEqual(data["history/measured_displacement"].shape, (20, 1, 2))


class Values(ResultsTest):
    """What is in the tables agrees with statics and with the other tables."""

    def test_forces_of_a_stack_at_rest(self):
        data, _ = self.run_model(INPUTS / "stack")
        first, last = data["frames/contact_offset"][-2:]
        weight = 24525 * data["model/block_area"]
        sums = np.zeros((6, 2))
        blocks, force = data["frames/contact_blocks"][first:last], data["frames/contact_force"][first:last]
        np.add.at(sums, blocks[:, 0], force)
        np.subtract.at(sums, blocks[:, 1], force)
        sums[:, 1] -= weight
        support = data["history/fixed_force"][-1]
        sums[0] += support.sum(axis=0)
        # a static step: what is left is the solver's tolerance, 1e-10 of the load, and the inertia of the last creep
        self.assertLess(np.abs(sums).max(), 1e-8 * weight.sum())
        self.assertAlmostEqual(support[:, 1].sum(), weight.sum(), delta=1e-8 * weight.sum())

    def test_measured_point_moves_with_its_block(self):
        data, _ = self.run_model(INPUTS / "pushed_block", "--save-every", "100")
        # the point is the block's centroid, and blocks move affinely: rounding of 1500 steps
        rows = data["frames/step"][1:] - 1
        moved = data["frames/centroid"][1:, 1] - data["model/block_centroid"][1]
        self.assertLess(np.abs(data["history/measured_displacement"][rows, 0] - moved).max(), 1e-11)
        self.assertGreater(moved[-1, 0], 0.4)
        self.assertTrue(np.array_equal(data["history/measured_stress"][rows, 0], data["frames/stress"][1:, 1]))
        self.assertTrue(np.array_equal(data["history/measured_rotation"][rows, 0], data["frames/rotation"][1:, 1]))

    def test_largest_displacement_and_energies_of_a_throw(self):
        data, _ = self.run_model(INPUTS / "free_fall", "--save-every", "1")
        steps = np.linalg.norm(np.diff(data["frames/vertices"], axis=0), axis=2).max(axis=1)
        # differences of coordinates of about 5: rounding
        self.assertLess(np.abs(data["history/max_displacement"] - steps).max(), 1e-13)
        energy = dict(zip(ENERGY_COLUMNS, data["history/energy"].T, strict=True))
        block = 1 + int(np.argmin(data["model/block_area"][1:]))
        velocity = data["frames/velocity"][1:, block]
        kinetic = 2500 / 2 * (velocity[:, :2] ** 2).sum(axis=1)
        height = data["frames/centroid"][1:, block, 1] - data["model/block_centroid"][block, 1]
        scale = 2500 / 2 * 52
        # the base settles on its supports by weight/stiffness, about 1e-7 m: its share of both energies is below 1e-6
        self.assertLess(np.abs(energy["kinetic"] - kinetic).max(), 1e-6 * scale)
        self.assertLess(np.abs(energy["gravity"] - 24525 * height).max(), 1e-6 * scale)


if __name__ == "__main__":
    unittest.main()
