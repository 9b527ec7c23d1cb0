# SPDX-License-Identifier: MIT
"""What `rockdda run` leaves: every dataset and attribute of the results file, the log, the summary, the options."""

import itertools
import os
import unittest
from pathlib import Path

from support import ANALYSIS, GEOMETRY, PEER_ANALYSIS, ProgramTest, h5py

if h5py is not None:
    import numpy as np

INPUTS = Path(__file__).resolve().parents[2] / "inputs"

ENERGY_COLUMNS = [
    "kinetic",
    "strain",
    "gravity",
    "springs",
    "external_work",
    "friction",
    "numerical_dissipation",
    "discarded",
    "geometry",
    "residual",
]

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


def read(path):
    """All datasets and attributes of a file."""
    data, attributes = {}, {}

    def visit(name, item):
        attributes[name] = dict(item.attrs)
        if isinstance(item, h5py.Dataset):
            data[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(visit)
        attributes["/"] = dict(file.attrs)
    return data, attributes


@unittest.skipIf(h5py is None, "h5py is missing")
class ResultsTest(ProgramTest):
    def run_model(self, *arguments, code=0):
        """Run to out.h5; datasets and attributes."""
        outcome = self.run_program("run", *arguments, "-o", "out.h5", "--force", "--quiet")
        self.assertEqual(outcome.code, code, outcome.err)
        return read(self.path("out.h5"))

    def assertSameData(self, one, other, but=()):
        self.assertEqual(sorted(one), sorted(other))
        for name in one:
            if name not in but:
                self.assertTrue(np.array_equal(one[name], other[name]), name)


class Layout(ResultsTest):
    """Names, shapes and types, and how the tables fit together."""

    def check(self, *arguments, fixed, loading, measured, save_every):
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
            "frames/step": ((nk,), INTEGER),
            "frames/time": ((nk,), REAL),
            "frames/vertices": ((nk, nv, 2), REAL),
            "frames/centroid": ((nk, nb, 2), REAL),
            "frames/rotation": ((nk, nb), REAL),
            "frames/stress": ((nk, nb, 3), REAL),
            "frames/velocity": ((nk, nb, 6), REAL),
            "frames/contact_offset": ((nk + 1,), INTEGER),
            "frames/contact_point": ((total, 2), REAL),
            "frames/contact_force": ((total, 2), REAL),
            "frames/contact_state": ((total,), INTEGER),
            "frames/contact_blocks": ((total, 2), INTEGER),
        }
        texts = ["input/analysis", "input/config", "input/geometry"]
        self.assertEqual(sorted(data), sorted([*expected, *texts]))
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
        self.check_contacts(data)
        last = data["history/step"][-1]
        steps = sorted({*range(0, last + 1, save_every), last})
        self.assertEqual(data["frames/step"].tolist(), steps)
        return data, attributes

    def check_attributes(self, attributes):
        root = attributes["/"]
        names = ["complete", "created", "exit_reason", "format", "format_version", "program_version", "title"]
        self.assertEqual(sorted(root), names)
        self.assertEqual((root["format"], root["format_version"]), ("rockdda", 1))
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

    def check_contacts(self, data):
        offset, state = data["frames/contact_offset"], data["frames/contact_state"]
        blocks, force, point = (data["frames/contact_" + k] for k in ("blocks", "force", "point"))
        self.assertEqual((offset[0], offset[-1]), (0, len(state)))
        self.assertTrue((np.diff(offset) >= 0).all())
        self.assertTrue(np.isin(state, [0, 1, 2]).all())
        self.assertFalse(force[state == 0].any(), "no force when open")
        self.assertTrue(((blocks >= 0) & (blocks < len(data["model/block_area"]))).all())
        self.assertTrue((blocks[:, 0] != blocks[:, 1]).all())
        first = data["model/vertex_offset"]
        for k, step in enumerate(data["frames/step"]):
            rows = slice(offset[k], offset[k + 1])
            if step > 0:
                numbers = np.bincount(state[rows], minlength=3)
                self.assertEqual(numbers.tolist(), data["history/contacts"][step - 1].tolist())
            for (a, _), p in zip(blocks[rows], point[rows], strict=True):
                corners = data["frames/vertices"][k, first[a] : first[a + 1]]
                self.assertTrue((corners == p).all(axis=1).any(), "a vertex of the first block")

    def test_own_model(self):
        data, attributes = self.check("block.dc", "block.df", fixed=2, loading=1, measured=1, save_every=3)
        self.assertEqual(data["model/vertex_offset"].tolist(), [0, 4, 8])
        self.assertEqual(attributes["model/loading_points"]["block"].tolist(), [1])
        self.assertEqual(attributes["model/fixed_points"]["block"].tolist(), [0, 0])
        self.assertEqual(data["model/edge_joint"].tolist(), [1] * 8)

    def test_pushed_block(self):
        arguments = (INPUTS / "pushed_block", "--steps", "50")
        self.check(*arguments, fixed=4, loading=1, measured=1, save_every=20)

    def test_bolted_beam(self):
        self.check(INPUTS / "bolted_beam", "--steps", "30", fixed=6, loading=0, measured=4, save_every=1)

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


class Steps(ResultsTest):
    """How long a run is and which steps become frames."""

    def frames(self, *arguments):
        data, _ = self.run_model("block.dc", "block.df", *arguments)
        return data["frames/step"].tolist(), data

    def test_steps_and_frames(self):
        self.assertEqual(self.frames("--steps", "7", "--save-every", "3")[0], [0, 3, 6, 7])
        self.assertEqual(self.frames("--steps", "6", "--save-every", "3")[0], [0, 3, 6])
        self.assertEqual(self.frames("--steps", "4", "--save-every", "50")[0], [0, 4])
        self.assertEqual(self.frames()[0], list(range(21)))

    def test_no_step(self):
        steps, data = self.frames("--steps", "0")
        self.assertEqual((steps, len(data["history/step"])), ([0], 0))

    def test_usual_number_of_frames(self):
        steps, _ = self.frames("--steps", "1000")
        self.assertEqual(steps, list(range(0, 1001, 10)))

    def test_frames_by_time(self):
        self.write("run.nml", "&run save_dt = 0.035 /\n")
        steps, data = self.frames("--config", "run.nml")
        self.assertEqual(data["history/attempts"].tolist(), [1] * 20)
        # the first step of 0.01 at or after each multiple of 0.035, and the last
        self.assertEqual(steps, [0, 4, 7, 11, 14, 18, 20])
        self.assertEqual(self.frames("--config", "run.nml", "--save-every", "10")[0], [0, 10, 20])

    def test_last_step_lands_on_the_end_time(self):
        data = self.frames("--t-end", "0.0537")[1]
        self.assertEqual(len(data["history/step"]), 6)
        self.assertAlmostEqual(data["history/time"][-1], 0.0537, delta=1e-15)
        self.assertAlmostEqual(data["history/dt"][-1], 0.0037, delta=1e-15)
        # an end time beyond the analysis file's steps extends the run; --steps limits it again
        self.assertAlmostEqual(self.frames("--t-end", "0.3")[1]["history/time"][-1], 0.3, delta=1e-14)
        self.assertEqual(len(self.frames("--t-end", "0.3", "--steps", "4")[1]["history/step"]), 4)

    def test_without_frames_or_contacts(self):
        self.write("run.nml", "&output frames = .false. /\n")
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml", "--json", "-o", "a.h5")
        data, _ = read(self.path("a.h5"))
        self.assertEqual((len(data["frames/step"]), data["frames/contact_offset"].tolist()), (0, [0]))
        self.assertEqual(outcome.json["frames"], 0)
        self.assertEqual(len(data["history/step"]), 20)
        self.write("run.nml", "&output contacts = .false. /\n")
        steps, data = self.frames("--config", "run.nml")
        self.assertEqual((len(steps), data["frames/contact_offset"].tolist()), (21, [0] * 22))
        self.assertEqual(data["frames/contact_force"].shape, (0, 2))


class Options(ResultsTest):
    def test_solvers_agree(self):
        expected, _ = self.run_model(INPUTS / "stack", "--solver", "dense", "--steps", "20")
        moved = np.abs(expected["frames/vertices"] - expected["model/vertices"]).max()
        for solver in ("auto", "pcg", "cholmod", "sor"):
            if solver == "cholmod" and "with_cholmod=on" not in self.run_program("--version").out.lower():
                continue
            with self.subTest(solver=solver):
                data, _ = self.run_model(INPUTS / "stack", "--solver", solver, "--steps", "20")
                # 20 steps with residuals of 1e-10 of the load; a factor of 5 for what the equations make of them
                error = np.abs(data["frames/vertices"] - expected["frames/vertices"]).max()
                self.assertLess(error, 1e-8 * moved)

    def test_threads_do_not_change_a_bit(self):
        for model, solver, steps in (
            ("jointed_slope", "auto", 5),
            ("jointed_slope", "pcg", 5),
            ("bolted_beam", "sor", 20),
        ):
            with self.subTest(model=model, solver=solver):
                arguments = (INPUTS / model, "--solver", solver, "--steps", str(steps), "--save-every", "1")
                one, _ = self.run_model(*arguments, "--threads", "1")
                two, _ = self.run_model(*arguments, "--threads", "2")
                self.assertSameData(one, two)

    def test_block_file_gives_the_same(self):
        self.assertEqual(self.run_program("cut", "block.dc").code, 0)
        one, _ = self.run_model("block.dc", "block.df")
        two, _ = self.run_model("block.blk", "block.df")
        self.assertSameData(one, two, but=["input/geometry"])
        self.assertEqual(two["input/geometry"].decode(), self.path("block.blk").read_text())

    def test_input_texts_are_kept(self):
        text = GEOMETRY.replace("# e0", "# plus petit écart, supérieur à 0\t").replace("\n", "\r\n")
        self.write("block.dc", text)
        self.write("run.nml", "! nothing\n&run steps = 2 /")
        data, _ = self.run_model("block.dc", "block.df", "--config", "run.nml")
        for name, file in (("geometry", "block.dc"), ("analysis", "block.df"), ("config", "run.nml")):
            self.assertEqual(data["input/" + name], self.path(file).read_bytes())
        data, _ = self.run_model("block.dc", "block.df")
        self.assertEqual(data["input/config"], b"")

    def test_config_overrides_files_and_is_overridden(self):
        self.write("run.nml", "&run steps = 5, title = 'Versuch 1' / &time dt_max = 0.004 / &solver method = 'pcg' /\n")
        data, attributes = self.run_model("block.dc", "block.df", "--config", "run.nml")
        self.assertEqual(data["history/dt"].tolist(), [0.004] * 5)
        self.assertEqual(attributes["/"]["title"], "Versuch 1")
        log = self.path("out.log").read_text()
        self.assertIn("number of steps 5 replaces 20 of the analysis file", log)
        self.assertRegex(log, r"solver += pcg\n")
        outcome = self.run_program(
            "run", "block.dc", "block.df", "--config=run.nml", "--steps=3", "--solver=dense", "--json"
        )
        self.assertEqual((outcome.json["steps"], outcome.json["solver"]), (3, "dense"))

    def test_output_of_the_namelist(self):
        self.write("run.nml", "&output file = 'sub/named.h5' /\n")
        self.path("sub").mkdir()
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--config", "run.nml").code, 0)
        named = ["sub/named.ckpt.h5", "sub/named.h5", "sub/named.log"]
        self.assertEqual(self.files(), ["block.dc", "block.df", "run.nml", *named])

    def test_peer_dialect(self):
        self.write("block.df", PEER_ANALYSIS)
        outcome = self.run_program("run", "block.dc", "block.df", "--dialect", "peer", "--quiet")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        self.write("block.df", ANALYSIS)
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--dialect", "peer", "-o", "x.h5").code, 2)
        self.assertFalse(self.path("x.h5").exists())


class Output(ResultsTest):
    """Where results go, and what is never overwritten."""

    def test_default_name_in_the_current_folder(self):
        self.path("work").mkdir()
        self.write("case.df", ANALYSIS)
        outcome = self.run_program("run", "../block.dc", "../case.df", cwd=self.path("work"))
        self.assertEqual(outcome.code, 0)
        self.assertEqual(
            self.files(), ["block.dc", "block.df", "case.df", "work/case.ckpt.h5", "work/case.h5", "work/case.log"]
        )

    def test_folder(self):
        self.write("model/m.dc", GEOMETRY)
        self.write("model/m.df", ANALYSIS)
        self.write("model/m.nml", "&run steps = 3 /\n")
        outcome = self.run_program("run", "model", "--json")
        self.assertEqual((outcome.code, outcome.json["steps"], outcome.json["output"]), (0, 3, "m.h5"))
        self.assertEqual(self.files()[-3:], ["model/m.dc", "model/m.df", "model/m.nml"])
        self.assertTrue(self.path("m.h5").exists())

    def test_existing_output(self):
        self.write("block.h5", "mine")
        self.write("block.log", "mine too")
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertFails(outcome, 2, "rockdda: error: block.h5: the file exists; use --force to overwrite it")
        self.assertEqual(self.path("block.h5").read_text() + self.path("block.log").read_text(), "minemine too")
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--force").code, 0)
        self.assertEqual(read(self.path("block.h5"))[1]["/"]["complete"], 1)

    def test_results_of_another_ending_keep_their_checkpoint(self):
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "a.h5").code, 0)
        before = {name: self.path(name).read_bytes() for name in self.files()}
        for name in ("a.hdf5", "a"):
            outcome = self.run_program("run", "block.dc", "block.df", "-o", name, "--force", "--quiet")
            message = (
                f"{name}: these results would have the checkpoint a.ckpt.h5, which is that of a.h5; take another name"
            )
            self.assertFails(outcome, 2, f"rockdda: error: {message}")
        self.assertEqual({name: self.path(name).read_bytes() for name in self.files()}, before)
        # without those results it is nobody's
        self.path("a.h5").unlink()
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "a.hdf5").code, 0)
        self.assertEqual(self.run_program("resume", "a.ckpt.h5", "--steps", "2").code, 0)

    def test_bad_input_keeps_the_old_output_even_with_force(self):
        self.write("block.h5", "mine")
        self.write("block.df", ANALYSIS.replace("30 0 0\n", "30 0 -1\n"))
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--force").code, 2)
        self.assertEqual(self.path("block.h5").read_text(), "mine")

    def test_input_is_never_the_output(self):
        for name in ("block.dc", "./block.df"):
            outcome = self.run_program("run", "block.dc", "block.df", "-o", name, "--force")
            self.assertFails(outcome, 2, f"rockdda: error: {name}: the output would overwrite an input file")
        self.assertEqual(self.path("block.dc").read_text() + self.path("block.df").read_text(), GEOMETRY + ANALYSIS)

    def test_devices_and_pipes_are_no_outputs(self):
        os.mkfifo(self.path("pipe.h5"))
        for force in ([], ["--force"]):
            outcome = self.run_program("run", "block.dc", "block.df", "-o", "pipe.h5", *force)
            message = "pipe.h5: this is no regular file: results cannot be written to it"
            self.assertFails(outcome, 2, "rockdda: error: " + message)
            self.assertTrue(self.path("pipe.h5").is_fifo())
            self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_output_that_cannot_be_created(self):
        outcome = self.run_program("run", "block.dc", "block.df", "-o", "none/x.h5")
        self.assertEqual(outcome.code, 5)
        self.assertIn("none/x.h5: No such file or directory", outcome.err)

    def test_locale_and_time_zone_change_nothing(self):
        one, _ = self.run_model("block.dc", "block.df")
        environment = {**os.environ, "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Asia/Tokyo"}
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "b.h5", env=environment).code, 0)
        self.assertSameData(one, read(self.path("b.h5"))[0])


class Report(ResultsTest):
    """The summary and the log."""

    def test_json(self):
        outcome = self.run_program("run", "block.dc", "block.df", "--json", "--save-every", "6")
        self.assertEqual(outcome.code, 0)
        summary = outcome.json
        data, _ = read(self.path("block.h5"))
        figures = {
            key: summary[key] for key in ("command", "status", "exit_code", "exit_reason", "output", "log", "blocks")
        }
        self.assertEqual(
            figures,
            {
                "command": "run",
                "status": "done",
                "exit_code": 0,
                "exit_reason": "finished",
                "output": "block.h5",
                "log": "block.log",
                "blocks": 2,
            },
        )
        self.assertEqual(summary["steps"], data["history/step"][-1])
        self.assertEqual(summary["time"], data["history/time"][-1])
        self.assertEqual(summary["frames"], len(data["frames/step"]))
        contacts = [summary["contacts"][k] for k in ("open", "sliding", "locked")]
        self.assertEqual(contacts, data["history/contacts"][-1].tolist())
        self.assertEqual(list(summary["energy"]), ENERGY_COLUMNS)
        self.assertEqual(list(summary["energy"].values()), data["history/energy"][-1].tolist())
        self.assertEqual(summary["errors"], 0)

    def test_text(self):
        outcome = self.run_program("run", "block.dc", "block.df", "--steps", "4", "--quiet")
        self.assertEqual(outcome.err, "")
        lines = outcome.out.splitlines()
        self.assertTrue(lines[0].startswith("done: 4 steps to time 0.04, 2 blocks, contacts "), lines)
        self.assertEqual(lines[1:], ["results: block.h5 (5 frames), log: block.log"])

    def logged(self):
        lines = self.path("out.log").read_text().splitlines()
        self.assertTrue(lines[-1].startswith("end: finished after "))
        head = [line.startswith("#") for line in lines].index(True)
        return [line.split() for line in lines[head + 1 : -1] if not line.startswith("#")]  # notes

    def test_log_has_a_line_for_each_reported_step(self):
        data, _ = self.run_model("block.dc", "block.df")
        rows = self.logged()
        self.assertEqual([int(row[0]) for row in rows], data["history/step"].tolist())
        energies = np.array([[float(x) for x in row[-10:]] for row in rows])
        # printed with 14 digits
        scale = np.abs(data["history/energy"]).max()
        self.assertLess(np.abs(energies - data["history/energy"]).max(), 1e-13 * scale)
        self.assertTrue(np.allclose([float(row[1]) for row in rows], data["history/time"], rtol=1e-6, atol=0))

    def test_log_of_a_long_run_reports_some_steps(self):
        data, _ = self.run_model("block.dc", "block.df", "--steps", "2503", "--save-every", "501")
        again = data["history/step"][data["history/attempts"] > 1].tolist()
        steps = {1, 2503, *range(0, 2504, 2), *range(0, 2504, 501), *again} - {0}
        self.assertEqual([int(row[0]) for row in self.logged()], sorted(steps))

    def test_no_terminal_codes_in_a_pipe(self):
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertEqual(outcome.code, 0)
        self.assertNotRegex(outcome.err, r"[\r\x1b]")


if __name__ == "__main__":
    unittest.main()
