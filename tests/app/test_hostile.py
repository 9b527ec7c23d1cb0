# SPDX-License-Identifier: MIT
"""Models that are well formed and make no sense, damaged results, absurd sizes: a clear answer or sane results."""

import math
import os
import unittest
from pathlib import Path

from support import GEOMETRY, ProgramTest, h5py

if h5py is not None:
    import numpy as np

LINES = GEOMETRY.splitlines()[8:15]
FIXED = ("0.5 0.5 0.5 0.5", "3.5 0.5 3.5 0.5")
NO_POINTS = {"fixed": (), "measured": ()}


def geometry(lines=LINES, e0="0.01", fixed=FIXED, measured=("2 1.5",), holes=()):
    counts = [e0, f"{len(lines)} 4", "0", "0", str(len(fixed)), "0", str(len(measured)), str(len(holes))]
    return "\n".join([*counts, *lines, *fixed, *measured, *holes, ""])


def analysis(k01=1, g2=0.01, dt=0.01, rho=1000, gamma=9810, e=1e8, nu=0.2, s="0 0 0", v="0 0 0", phi=30):
    return f"{k01} 4 1 1 {g2} {dt}\n{rho} {gamma} {e} {nu} {s} 0 0 0 {v}\n{phi} 0 0\n"


def scaled(factor):
    """The same model in another unit."""

    def scale(text):
        return " ".join(repr(float(word) * factor) for word in text.split())

    lines = [scale(" ".join(line.split()[:4])) + " 1" for line in LINES]
    return geometry(lines, repr(0.01 * factor), [scale(point) for point in FIXED], [scale("2 1.5")])


def turned(line):
    words = line.split()
    return " ".join([*words[2:4], *words[0:2], words[4]])


def star(n):
    """Lines through one point."""
    ends = [(3 * math.cos(math.pi * k / n), 3 * math.sin(math.pi * k / n)) for k in range(n)]
    return [f"{2 - x!r} {0.5 - y!r} {2 + x!r} {0.5 + y!r} 1" for x, y in ends]


@unittest.skipIf(h5py is None, "h5py is missing")
class SenselessModelTest(ProgramTest):
    def run_model(self, model=None, parameters=None):
        self.write("m.dc", model or geometry())
        self.write("m.df", parameters or analysis())
        self.path("m.h5").unlink(missing_ok=True)
        outcome = self.run_program("run", "m.dc", "m.df", "--quiet")
        self.assertNotIn("internal error", outcome.err)
        return outcome

    def check_refused(self, words, model=None, parameters=None):
        outcome = self.run_model(model, parameters)
        self.assertIn(words, outcome.err)
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertFalse(self.path("m.h5").exists())
        return outcome

    def check_runs(self, model=None, parameters=None, blocks=2):
        outcome = self.run_model(model, parameters)
        self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("m.h5"), "r") as file:
            self.assertEqual(len(file["model/block_area"]), blocks)
            for name in ("frames/vertices", "frames/stress", "frames/velocity", "history/energy"):
                self.assertTrue(np.isfinite(file[name][()]).all(), name)

    def check_gives_up(self, words, model=None, parameters=None):
        """Nothing comes of it, but what came before can be read."""
        outcome = self.run_model(model, parameters)
        self.assertIn(words, outcome.err)
        self.assertEqual(outcome.code, 3, outcome.err)
        self.assertEqual(self.run_program("info", "m.h5").code, 0)

    def test_lines_that_lie_on_each_other_are_one(self):
        self.check_runs(geometry(LINES + LINES))
        self.check_runs(geometry(LINES + [turned(line) for line in LINES]))

    def test_lines_that_enclose_nothing_are_refused(self):
        words = "the outline does not close"
        self.check_refused(words, geometry([f"{k} 0 {k + 1.5} 0 1" for k in range(5)], fixed=()))
        self.check_refused(words, geometry([f"0 {k} 4 {k} 1" for k in range(5)], fixed=()))
        self.check_refused(words, geometry(["0 0 1 0 1", "0 0 0 1 1", "0 1 1 1.5 1", "5 5 6 6 1"], fixed=()))

    def test_e0_larger_than_everything_is_refused(self):
        self.check_refused("no closed block", geometry(e0="10"))

    def test_holes_everywhere_leave_nothing(self):
        self.check_refused("no block left", geometry(holes=("2 0.5", "2 1.5"), **NO_POINTS))

    def test_two_holes_in_one_block_are_one(self):
        self.check_runs(geometry(holes=("2 1.5", "2 1.6"), measured=()), blocks=1)

    def test_a_thousand_fixed_points_in_one_place(self):
        self.check_runs(geometry(fixed=("0.5 0.5 0.5 0.5",) * 1000))

    def test_many_lines_through_one_point(self):
        self.check_runs(geometry(LINES[:4] + star(9), e0="1e-6", **NO_POINTS), blocks=18)

    def test_a_sliver(self):
        lines = ["0 0 1 0 1", "1 0 0 1e-9 1", "0 1e-9 0 0 1"]
        self.check_runs(geometry(lines + lines[:1], e0="1e-12", **NO_POINTS), blocks=1)
        with h5py.File(self.path("m.h5"), "r") as file:
            self.assertEqual(file["model/block_area"][0], 5e-10)
            # nothing holds it: from rest it falls as a block of any shape does, by g t^2/2
            time = file["frames/time"][-1]
            fallen = file["frames/vertices"][-1] - file["frames/vertices"][0]
            np.testing.assert_allclose(fallen[:, 1], -0.5 * 9.81 * time**2, rtol=1e-9)
            np.testing.assert_allclose(fallen[:, 0], 0, atol=1e-12)

    def test_units_in_which_numbers_vanish_or_explode_are_refused(self):
        self.check_refused("must be at least 1e-30", scaled(1e-300))
        self.check_refused("must be at least 1e-30", scaled(1e-50))
        self.check_refused("must not be larger than 1e+30", scaled(1e60))
        self.check_refused("must not be larger than 1e+30", scaled(1e300))

    def test_large_units_are_as_good(self):
        self.check_runs(scaled(1e12))

    def test_a_model_far_from_the_origin(self):
        def far(text, distance):
            return " ".join(repr(float(word) + distance) for word in text.split())

        lines = [far(" ".join(line.split()[:4]), 1e9) + " 1" for line in LINES]
        self.check_runs(geometry(lines, fixed=[far(point, 1e9) for point in FIXED], measured=()))
        lines = [far(" ".join(line.split()[:4]), 1e16) + " 1" for line in LINES]
        self.check_refused("of the largest coordinate", geometry(lines, **NO_POINTS))

    def test_extreme_materials(self):
        # what a block on a fixed one does is the same for all of these: it stays, to within what its weight compresses
        for parameters in (
            analysis(e="1e60"),
            analysis(rho="1e60"),
            analysis(gamma="0"),
            analysis(nu="0.49999999999"),
            analysis(phi="89.99999999"),
            analysis(k01="1e-300"),
        ):
            with self.subTest(parameters):
                self.check_runs(parameters=parameters)
                with h5py.File(self.path("m.h5"), "r") as file:
                    moved = file["frames/vertices"][-1] - file["frames/vertices"][0]
                    # 1.6e-4 with the plain material; free fall in the four steps is 7.8e-3
                    self.assertLess(np.abs(moved).max(), 2e-4)
        # what nothing holds moves by g t^2/2, down or up
        for parameters, sign in ((analysis(e="1e-60"), -1), (analysis(gamma="-9810"), 1)):
            with self.subTest(parameters):
                self.check_runs(parameters=parameters)
                with h5py.File(self.path("m.h5"), "r") as file:
                    moved = file["frames/vertices"][-1] - file["frames/vertices"][0]
                    furthest = moved[np.abs(moved[:, 1]).argmax(), 1]
                    self.assertAlmostEqual(furthest / (sign * 0.5 * 9.81 * 0.04**2), 1, delta=1e-9)

    def test_extreme_steps(self):
        for parameters in (
            analysis(dt="1e-60"),
            analysis(dt="1e60"),
            analysis(dt="1e6", k01="0"),
            analysis(g2="1e-60"),
            analysis(g2="1e60"),
        ):
            with self.subTest(parameters):
                self.check_runs(parameters=parameters)

    def test_loads_beyond_all_measure_end_the_run_in_order(self):
        if "-ffpe-trap" in self.run_program("--version").out:
            self.skipTest("this build stops at the first overflow")
        self.check_gives_up("cannot be solved", parameters=analysis(gamma="1e60"))
        self.check_gives_up("cannot be solved", parameters=analysis(s="1e60 0 0"))
        self.check_gives_up("cannot be solved", parameters=analysis(v="1e60 0 0"))

    def test_numbers_of_the_wrong_size_are_refused(self):
        self.check_refused("must not be larger than 1e+60", parameters=analysis(e="1e61"))
        self.check_refused("found 'nan'", parameters=analysis(gamma="nan"))
        self.check_refused("1e400", parameters=analysis(gamma="1e400"))

    def test_a_mistyped_weight_does_not_make_all_blocks_neighbours(self):
        """40 blocks in a row: 39 pairs touch, whatever the blocks weigh."""
        lines = ["0 0 40 0 1", "40 0 40 1 1", "40 1 0 1 1", "0 1 0 0 1", *(f"{k} 0 {k} 1 1" for k in range(1, 40))]
        self.write("row.dc", geometry(lines, measured=()))
        self.write("row.df", analysis(gamma="1e16"))
        outcome = self.run_program("run", "row.dc", "row.df", "--steps", "1", "--json", "--quiet")
        # each joint has two ends with two corners each
        self.assertLessEqual(sum(outcome.json["contacts"].values()), 4 * 39)


@unittest.skipIf(h5py is None, "h5py is missing")
class DamageTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_program("run", "block.dc", "block.df").code, 0)
        self.good = self.path("block.h5").read_bytes()

    def without_sizes(self, good):
        bad = bytearray(good)
        place = bad.find(b"GCOL")
        self.assertGreater(place, 0)
        while place > 0:
            # object 1: index 2 bytes, references 2, reserved 4, size 8
            bad[place + 16 : place + 4096] = bytes(4080)
            bad[place + 16] = 7
            place = bad.find(b"GCOL", place + 4)
        return bytes(bad)

    def test_a_heap_in_which_hdf5_reads_for_ever(self):
        """Sizes of 0 in the heap of texts keep the library in a loop."""
        self.write("bad.h5", self.without_sizes(self.good))
        outcome = self.run_program("info", "bad.h5", timeout=60)
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertIn("bad.h5: error: the file is damaged", outcome.err)

    def test_results_to_go_on_with_are_looked_at_first(self):
        outcome = self.run_program("run", "block.dc", "block.df", "--force", "--steps", "1000000", "--max-wall", "0.3")
        self.assertEqual(outcome.code, 4, outcome.err)
        bad = self.without_sizes(self.path("block.h5").read_bytes())
        self.write("block.h5", bad)
        outcome = self.run_program("resume", "block.ckpt.h5", timeout=60)
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertIn("block.h5: error: the file is damaged", outcome.err)
        self.assertEqual(self.path("block.h5").read_bytes(), bad)

    def test_who_is_killed_while_looking_leaves_no_lock(self):
        """The process that tries a damaged file for its parent does not hold on to it."""
        self.write("block.h5", self.without_sizes(self.good))
        process = self.start_program("resume", "block.ckpt.h5", "--steps", "1")
        self.wait_for_busy_child(process)
        process.kill()
        process.wait()
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "1", timeout=60)
        self.assertIn("block.h5: error: the file is damaged", outcome.err)

    def wait_for_busy_child(self, process):
        """Until it has worked for some time, which it does for a second."""
        while process.poll() is None:
            for path in Path("/proc").glob("[0-9]*/stat"):
                try:
                    fields = path.read_text().rsplit(")", 1)[1].split()
                except OSError:
                    continue  # ended in the meantime
                # state, number of the parent; user time
                if int(fields[1]) == process.pid and int(fields[11]) >= 0.1 * os.sysconf("SC_CLK_TCK"):
                    return
        self.fail(process.communicate()[1])

    def test_truncated_results_are_refused(self):
        for n in (0, 1, 8, 100, 2048, len(self.good) // 2, len(self.good) - 1):
            self.write("bad.h5", self.good[:n])
            for command in ("info", "check"):
                outcome = self.run_program(command, "bad.h5")
                self.assertEqual(outcome.code, 2, outcome.err)
                self.assertIn("bad.h5", outcome.err)


class NoiseTest(ProgramTest):
    def test_bytes_of_no_encoding_leave_the_summary_valid_json(self):
        noise = bytes(range(1, 256))
        for name, text in (("noise.dc", noise), ("noise.df", b"1 " + noise), ("noise.nml", b"&run " + noise)):
            self.write(name, text)
            outcome = self.run_program("check", name, "--json")
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertGreater(outcome.json["errors"], 0)

    def test_a_line_of_a_million_characters(self):
        self.write("long.nml", "&time " + "max_open_close" * 70000 + " = 1 /")
        outcome = self.run_program("check", "long.nml")
        self.assertEqual(outcome.code, 2)
        self.assertLess(len(outcome.err), 1000)
        self.assertIn("did you mean 'max_open_close'?", outcome.err)

    def test_a_hundred_thousand_groups_without_an_end(self):
        self.write("groups.nml", "&run" * 100000)
        outcome = self.run_program("check", "groups.nml", timeout=20)
        self.assertEqual(outcome.code, 2)
        self.assertIn("... and 99950 more", outcome.err)

    def test_words_that_no_separator_ends(self):
        """A message quotes the start of a word; the rest of the line is not read for it."""
        self.write("words.nml", "&run " + "^" * 400000 + " /")
        outcome = self.run_program("check", "words.nml", timeout=20)
        self.assertEqual(outcome.code, 2)
        self.assertIn("words.nml:1:46: error: expected a name or '/', found '" + "^" * 40 + "'", outcome.err)

    def test_a_thousand_million_values(self):
        self.write("many.nml", "&load harmonic = " + "1000000*1 " * 1000 + "/")
        outcome = self.run_program("check", "many.nml", timeout=20)
        self.assertEqual(outcome.code, 2)
        self.assertIn("many.nml:1:18: error: harmonic: more than 100000 values", outcome.err)


if __name__ == "__main__":
    unittest.main()
