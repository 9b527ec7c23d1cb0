# SPDX-License-Identifier: MIT
"""Records of ground acceleration: how files are read, what they move, and what is said of bad ones."""

import re
import unittest

from results_case import ResultsTest
from support import h5py

if h5py is not None:
    import numpy as np

# A block 2 x 2 held at two points, and a loose one high above it; a measured point in each.
GEOMETRY = """\
0.001
8 8
0
0
2
0
2
0
0 0 2 0 1
2 0 2 2 1
2 2 0 2 1
0 2 0 0 1
0 9 2 9 1
2 9 2 11 1
2 11 0 11 1
0 11 0 9 1
0.2 0.2 0.2 0.2
1.8 0.2 1.8 0.2
1 1
1 10
"""
MODEL = """\
&model geometry = 'two.dc' /
&block_material number = 1, density = 2500, young = 1e10, poisson = 0.2 /
&joint_material number = 1, friction = 30 /
&load gravity = 0 /
&time dt_max = 0.01, integrator = 'shi' /
&run t_end = 0.5 /
"""
# 1 from the start to 0.25, then -1 to 0.5: at rest there, at a distance of 1/16
CSV = "# station\ntime, E (m/s2), N\n0, 0, 1\n0.25, 0, 1\n0.25, 0, -1\n0.5, 0, -1\n"


@unittest.skipIf(h5py is None, "h5py is missing")
class Quake(ResultsTest):
    def setUp(self):
        super().setUp()
        self.write("two.dc", GEOMETRY)
        self.write("record.csv", CSV)

    def moved(self, quake):
        """History of the displacement of both points."""
        self.write("two.nml", MODEL + quake)
        data, _ = self.run_model("two.nml")
        self.assertAlmostEqual(data["history/time"][-1], 0.5)
        return data["history/time"], data["history/measured_displacement"]

    def errors(self, quake):
        self.write("two.nml", MODEL + quake)
        outcome = self.run_program("check", "two.nml")
        self.assertEqual(outcome.code, 2, outcome.err)
        return [line for line in outcome.err.splitlines() if ": error: " in line]

    def test_base_acceleration_moves_what_is_loose_backwards(self):
        """Relative to the base: -u(t) of the ground, exactly, for a record that jumps between steps."""
        time, moved = self.moved("&quake record = 'record.csv', column = 'n', scale = 2 /")
        early = time <= 0.25 + 1e-9
        expected = np.where(early, time**2, 2 * (0.0625 - 0.5 * (0.5 - time) ** 2))
        np.testing.assert_allclose(moved[:, 1, 0], -expected, rtol=1e-9, atol=1e-12)
        self.assertLess(np.abs(moved[:, 0, 0]).max(), 1e-5)

    def test_the_default_scheme_is_of_second_order_across_jumps(self):
        """A jump costs an error of the order of a dt^2."""
        self.write("two.nml", MODEL.replace(", integrator = 'shi'", "") + "&quake record = 'record.csv', column = 3 /")
        data, _ = self.run_model("two.nml")
        self.assertAlmostEqual(data["history/measured_displacement"][-1, 1, 0], -0.0625, delta=0.01**2)

    def test_base_motion_takes_the_supports_along(self):
        """Fixed points follow the displacement of the ground (their springs yield by m a/k); loose blocks stay."""
        time, moved = self.moved("&quake record = 'record.csv', column = 3, apply = 'base_motion', direction = 'y' /")
        early = time <= 0.25 + 1e-9
        expected = np.where(early, 0.5 * time**2, 0.0625 - 0.5 * (0.5 - time) ** 2)
        np.testing.assert_allclose(moved[:, 0, 1], expected, atol=1e-5)
        self.assertEqual(np.abs(moved[:, 1]).max(), 0)

    def test_boundaries_follow_the_ground_too(self):
        geometry = GEOMETRY.replace("\n2\n0\n2\n0\n0 0", "\n0\n0\n2\n0\n0 0").replace("0.2 0.2 0.2 0.2\n", "")
        self.write("two.dc", geometry.replace("1.8 0.2 1.8 0.2\n", ""))
        boundary = "&boundary along = 0,0, 2,0, kind = 'fixed' /\n"
        _, moved = self.moved(boundary + "&quake record = 'record.csv', column = 3, apply = 'base_motion' /")
        self.assertAlmostEqual(moved[-1, 0, 0], 0.0625, delta=1e-5)

    def test_peer_file_is_in_g(self):
        rows = ["0.1"] * 51
        heads = ("NPTS=    51, DT=   .0100 SEC,", "51  .01  NPTS, DT", "npts=51,dt=1d-2", "DT= .01 SEC, NPTS= 51",
                 "NPTS= 51\nDT= .0100SEC", "DT= 10 MSEC\nNPTS: 51", ".01 51 DT NPTS")  # fmt: skip
        for head in heads:
            lines = ["PEER STRONG MOTION", "A place, 1/2/2003, 090", "ACCELERATION IN UNITS OF G", head]
            self.write(
                "record.AT2", "\n".join(lines) + "\n" + "\n".join("  ".join(rows[i : i + 5]) for i in range(0, 51, 5))
            )
            _, moved = self.moved("&quake record = 'record.AT2' /")
            self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 0.981 * 0.25, delta=1e-9)
        _, moved = self.moved("&quake record = 'record.AT2', scale = 1, direction = 'y' /")
        self.assertAlmostEqual(moved[-1, 1, 1], -0.5 * 0.1 * 0.25, delta=1e-9)

    def test_records_name_their_unit(self):
        """0.1 g, in the unit that the header names; a scale that is given is all there is."""
        for unit, factor in (
            ("G", 1), ("G. FILTER POINTS: HP=0.2 Hz", 1), ("CM/S/S", 981), ("CM/SEC**2", 981), ("GAL", 981),
            ("M/S2", 9.81),            ("mm/s^2", 9810), ("m/s\u00b2", 9.81), ("FT/SEC/SEC", 9.81 / 0.3048),
        ):  # fmt: skip
            value = f"{0.1 * factor:.15g} "
            lines = ["PEER", "A place", f"ACCELERATION TIME SERIES IN UNITS OF {unit}", "NPTS= 51, DT= .01", value * 51]
            for encoding in ("utf-8", "latin-1", "utf-16"):
                self.path("record.AT2").write_bytes("\r".join(lines).encode(encoding))
                self.write("two.nml", MODEL + "&quake record = 'record.AT2' /")
                outcome = self.run_program("check", "two.nml")
                self.assertEqual(outcome.code, 0, outcome.err)
                if encoding == "utf-8":
                    _, moved = self.moved("&quake record = 'record.AT2' /")
                    self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 0.981 * 0.25, delta=1e-9)
        self.write("record.csv", "t [ms], a (gal)\n0, 98.1\n500, 98.1\n")
        _, moved = self.moved("&quake record = 'record.csv' /")
        self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 0.981 * 0.25, delta=1e-9)
        _, moved = self.moved("&quake record = 'record.csv', scale = 0.02 /")
        self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 1.962 * 0.25, delta=1e-9)

    def test_units_outside_brackets_count_where_they_are_plain(self):
        """0.2 g; what names no unit is taken in the unit of the model, and a note says so."""
        times = ((0, "0"), (0.5, "0.5"))
        for head, factor in (
            ("Time [s],Acceleration in g", 1), ("time_s,acc_g", 1), ("time_s,acc_cm/s2", 981),
            ("# station\n# units: g\ntime,a", 1), ("! Unit = gal\nt a", 981), ("# units: gal", 981),
            ("# units: g\nt,a [m/s2]", 9.81), ("t [s],a [m/s2]", 9.81),
        ):  # fmt: skip
            with self.subTest(head=head):
                separator = " " if head.endswith("t a") else ","
                rows = [f"{t}{separator}{0.2 * factor:.15g}" for _, t in times]
                self.write("record.csv", "\n".join([head, *rows]) + "\n")
                _, moved = self.moved("&quake record = 'record.csv' /")
                self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 1.962 * 0.25, delta=1e-9)
        self.write("record.csv", "time_ms,acc_gal\n0,196.2\n500,196.2\n")
        _, moved = self.moved("&quake record = 'record.csv', column = 'acc' /")
        self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 1.962 * 0.25, delta=1e-9)
        quake = "&quake record = 'record.csv' /"
        for head in ("t,a", "t,a_g", "# in units of g\nt,acc_x", "t,e"):
            self.write("record.csv", head + "\n0,0.2\n0.5,0.2\n")
            for system, unit in (("none", "the model's units"), ("SI", "m/s^2")):
                self.write("two.nml", MODEL.replace("'two.dc'", f"'two.dc', units = '{system}'") + quake)
                outcome = self.run_program("check", "two.nml")
                note = f"note: &quake 1: the record names no unit: its values are taken as in {unit} "
                self.assertIn(note, outcome.err.replace("\n", " "))
        self.assertNotIn("names no unit", self.check("&quake record = 'record.csv', scale = 1 /"))

    def check(self, quake):
        """The messages of a check."""
        self.write("two.nml", MODEL + quake)
        outcome = self.run_program("check", "two.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        return outcome.err

    def test_a_file_of_peer_under_another_name_is_told_once(self):
        rows = "  .1  .2  .3  .4  .5\n" * 130
        for head in ("PEER\nx\nACCELERATION IN UNITS OF G\nNPTS= 650, DT= .01\n", "a\nb\nc\n  650  0.01  NPTS, DT\n"):
            self.write("record.txt", head + rows)
            found = self.errors("&quake record = 'record.txt', format = 'csv' /")
            self.assertEqual(len(found), 1, found[:3])
            self.assertRegex(
                found[0], r"record.txt:4:\d+: error: this is a file of the PEER database .* format = 'at2'"
            )

    def test_a_record_in_g_moves_a_model_in_millimetres_as_far(self):
        """Invariant: the system of units of a model does not change what a record does, whatever unit it names."""
        at2 = "A\nB\nACCELERATION IN UNITS OF G\nNPTS= 4, DT= .1\n.1 -.05 .02 .1\n"
        for name, text in (("r.at2", at2), ("r.csv", "t [s], a [cm/s2]\n0, 100\n0.2, -50\n0.4, 80\n")):
            self.write(name, text)
            self.write("two.dc", GEOMETRY)
            _, metres = self.moved(f"&quake record = '{name}' /")
            lines = [line.split() for line in GEOMETRY.splitlines()]
            scaled = [[str(1000 * float(x)) for x in row[:4]] + row[4:] for row in lines]
            scaled = [new if i == 0 or i > 7 else old for i, (old, new) in enumerate(zip(lines, scaled, strict=True))]
            self.write("two.dc", "\n".join(map(" ".join, scaled)) + "\n")
            model = MODEL.replace("'two.dc'", "'two.dc', units = 'mm'").replace("2500", "2.5e-9").replace("1e10", "1e4")
            self.write("two.nml", model + f"&quake record = '{name}' /")
            data, _ = self.run_model("two.nml")
            moved = data["history/measured_displacement"]
            self.assertGreater(np.abs(metres).max(), 0.01)
            # the same steps but for the rounding of the numbers
            np.testing.assert_allclose(moved / 1000, metres, rtol=0, atol=1e-12)

    def test_decimal_commas_between_semicolons_or_tabs_are_read(self):
        for text in ("t;a\n0;0,981\n0,5;0,981\n", "0\t0,981\n0,5\t0,981\n", "t;a\r0,0;9,81e-1\r5,0D-1;0,981;\r\x1a"):
            self.write("record.csv", text)
            _, moved = self.moved("&quake record = 'record.csv' /")
            self.assertAlmostEqual(moved[-1, 1, 0], -0.5 * 0.981 * 0.25, delta=1e-9)

    def test_the_ground_starts_from_where_it_is(self):
        """A record with rows before t = 0: refused where the ground moves then, else displaced from where it rests."""
        base = "&quake record = 'record.csv', apply = 'base_motion' /"
        self.write("record.csv", "-1,1\n0,1\n0.001,0\n3,0\n")
        self.assertRegex(
            self.errors(base)[0], r"at t = 0, when the blocks are at rest, the ground would move at 1 m/s: cut"
        )
        # 1 m away and at rest when the run begins, then the motion of CSV
        self.write("record.csv", "-2,1\n-1,1\n-1,-1\n0,-1\n0,1\n0.25,1\n0.25,-1\n0.5,-1\n")
        _, moved = self.moved(base)
        self.assertAlmostEqual(moved[-1, 0, 0], 0.0625, delta=1e-5)

    def test_records_beside_the_run_are_told(self):
        for rows, message in (
            ("100,0\n101,1\n", r"begins at t = 100 s, and the run ends 0\.5 s after the motion has begun: it does"),
            ("-1,0\n2,1\n", r"begins at t = -1 s: what it does before t = 0 does not act"),
            ("0,0\n1,294.3\n", r"reaches 30 times the acceleration of gravity \(294\.3 m/s²\)"),
            (
                "".join(f"{0.01 * k:.2f},1\n" for k in range(40) if k != 20),
                r"record\.csv:21:1: warning: the rows are 0\.01",
            ),
        ):
            self.write("record.csv", rows)
            self.write("two.nml", MODEL.replace("gravity = 0", "gravity = 9.81") + "&quake record = 'record.csv' /")
            outcome = self.run_program("check", "two.nml")
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertRegex(outcome.err, message)
        self.write("record.csv", "-3,0\n-2,1\n")
        self.assertRegex(self.errors("&quake record = 'record.csv' /")[0], "the record ends at t = -2 s, before")

    def test_fixed_points_that_jump_at_the_start_are_told(self):
        self.write("two.nml", MODEL + "&fixed_point points = 2, displacement = -1,0,0, 1,1,0 /")
        outcome = self.run_program("check", "two.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIn(
            "the table of fixed point 2 gives a displacement of 0.5 m, 0 mm at time 0: the point jumps", outcome.err
        )

    def test_several_records_add_up(self):
        one = "&quake record = 'record.csv', column = 3 /\n"
        _, moved = self.moved(one + one + one.replace("/", ", direction = 'y' /"))
        np.testing.assert_allclose(moved[-1, 1], [-0.125, -0.0625], rtol=1e-9)

    def test_the_log_says_what_the_record_is(self):
        self.moved("&quake record = 'record.csv', column = 'n', scale = 2 /")
        log = self.path("out.log").read_text()
        self.assertRegex(log, r"quake 1 += format csv, column n, scale 2, direction x, apply base_acceleration, "
                              r"record 4 rows from t = 0 to 0\.5, largest value 1\n")  # fmt: skip

    def test_a_resumed_run_has_the_record(self):
        """In another folder, without the file."""
        self.write("two.nml", MODEL + "&quake record = 'record.csv', column = 3, apply = 'base_motion' /")
        whole, _ = self.run_model("two.nml")
        outcome = self.run_program("run", "two.nml", "-o", "half.h5", "--max-wall", "1e-9", "--quiet")
        self.assertEqual(outcome.code, 4, outcome.err)
        self.path("record.csv").unlink()
        outcome = self.run_program("resume", "half.ckpt.h5", "--quiet")
        self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("half.h5")) as file:
            self.assertTrue(
                np.array_equal(file["history/measured_displacement"][()], whole["history/measured_displacement"])
            )

    def test_bad_records_name_the_place(self):
        for text, form, message in (
            ("t,a\n0,1\n1,x\n", "csv", r"record:3:3: error: value of row 2: expected a number, found 'x'"),
            ("0 1\n1\n", "csv", r"record:2:1: error: row 2: expected at least 2 numbers on this line, found 1"),
            ("0 1\n1 2 3\n", "csv", r"record:2:5: error: row 2: expected 2 numbers .* found 3"),
            ("0 1\n2 1\n1 1\n", "csv", r"record:3:1: error: time of row 3: must not be smaller .* found '1'"),
            ("t,a\n", "csv", r"record:1:4: error: the record has no rows"),
            # one number a line, as in a file without times: told once
            ("a\n" + "0.5\n" * 400, "csv", r"record:2:1: error: row 1: expected at least 2 numbers .* found 1"),
            ("t,a\n0,5,1,25\n1,0,2,5\n", "csv", r"record:2:2: error: '0,5' may be one number with a decimal comma"),
            ("0,00,0,05\n0.5,1,1,1\n", "csv", r"record:1:2: error: '0,00' may be one number with a decimal comma"),
            ("0,0 0,5\n1,0 2,5\n", "csv", r"record:1:2: error: '0,0' may be one number with a decimal comma"),
            ("0;0.5\n1;2,5\n", "csv", r"record:2:4: error: a decimal comma, and a point in a number of line 1"),
            ("0;1.000,5\n1;2\n", "csv", r"record:1:8: error: between semicolons a comma is a decimal sign"),
            ("t,e,n\n0,,5\n1,,6\n", "csv", r"record:2:3: error: a number is missing before this separator"),
            ("t,a\n0,0.5,1.5\n1,2.5,2.5\n", "csv", r"record:2:7: error: the header has 2 names, this row 3 numbers"),
            ("t,a\n0,1\n", "csv", r"record:2:4: error: a record needs at least two rows"),
            ("t,a\n1,1\n1,2\n", "csv", r"record:3:4: error: all rows of the record have the same time"),
            ("t,v (cm/s)\n0,1\n1,2\n", "csv", r"record:1:1: error: column 'v \(cm/s\)' is no acceleration"),
            ("t,velocity\n0,1\n1,2\n", "csv", r"record:1:1: error: column 'velocity' is no acceleration"),
            ("t,a (pints)\n0,1\n1,2\n", "csv", r"record:1:1: error: the header names 'pints' as unit of column 'a'"),
            ("a,t\n0,1\n1,2\n", "csv", r"record:1:1: error: the header names the time in column 2: expected it in the"),
            ("t (h),a\n0,1\n1,2\n", "csv", r"record:1:1: error: the header names 'h' as unit of the times"),
            ("a\nb\n", "at2", r"record:1:1: error: this is no file of PEER"),
            ("a\nNPTS= 3, DT= .01\n1 2\n", "at2", r"record:3:4: error: the file ends after 2 values, NPTS is 3"),
            ("a\nNPTS= 1, DT= .01\n1 2\n", "at2", r"record:3:3: error: the file has more than the 1 value of NPTS"),
            ("a\nNPTS= x, DT= .01\n1 2\n", "at2", r"record:2:1: error: expected the number of values"),
            ("a\nNPTS= 2, DT= 0,01\n1 2\n", "at2", r"record:2:14: error: expected a number with a decimal point"),
            ("a\nNPTS= 2, DT= 5 hours\n1 2\n", "at2", r"record:2:16: error: expected s, ms or min as unit"),
            ("a\nDT= .01\n1 2\n", "at2", r"record:2:1: error: expected the number of values too \(NPTS= 4000\)"),
            ("a\nNPTS= 2, DT= .01\n0,1 0,2\n", "at2", r"record:3:5: .* more than the 2 values .* decimal comma"),
            (
                "VELOCITY TIME SERIES IN UNITS OF CM/S\nNPTS= 2, DT= .01\n1 2\n",
                "at2",
                r"record:1:1: error: this is a record of velocities or displacements",
            ),
            (
                "a\nDISPLACEMENT (CM)\nNPTS= 2, DT= .01\n1 2\n",
                "at2",
                r"record:2:1: error: this is a record of velocities or displacements",
            ),
            (
                "ACCELERATION IN UNITS OF FURLONGS\nNPTS= 2, DT= .01\n1 2\n",
                "at2",
                r"record:1:1: error: the values are in 'furlongs': expected one of g, m/s2",
            ),
            (
                "a\nNPTS= 5, DT= .01\n.1E+00 .2E+00\n-.1E+00-.2E+00-.3E+00\n",
                "at2",
                r"record:4:1: error: value 3: expected a number, found '-.1E\+00-.2E\+00-.3E\+00': are there numbers "
                "without blanks",
            ),
            ("a\nNPTS= 2, DT= .01\n1 NaN\n", "at2", r"record:3:3: error: value 2: expected a number, found 'NaN'"),
        ):
            with self.subTest(text=text):
                self.write("record", text)
                found = self.errors(f"&quake record = 'record', format = '{form}' /")
                self.assertEqual(len(found), 1, found)
                self.assertRegex(found[0], message)

    def test_bad_options_name_the_place(self):
        for options, message in (
            ("record = 'none.csv'", r"two\.nml:7:\d+: error: record: none\.csv: no such file"),
            ("column = 2", r"two\.nml:7:1: error: &quake: 'record' is missing"),
            ("record = 'record.csv', column = 'e (m/s)'",
             r"record\.csv:2:1: error: no column .* did you mean 'e \(m/s2\)'\?"),
            ("record = 'record.csv', column = 1", r"column '1' is not possible"),
            ("record = 'record.csv', column = 7", r"record\.csv:3:7: error: row 1: expected at least 7 numbers"),
            ("record = 'record.csv', apply = 'viscous_base'",
             r"two\.nml:7:1: error: &quake 1: apply = 'viscous_base' needs a &boundary"),
            ("record = 'record.csv', direction = 'z'", r"two\.nml:7:43: error: direction: "),
        ):  # fmt: skip
            with self.subTest(options=options):
                found = self.errors(f"&quake {options} /")
                self.assertRegex(found[0], message)

    def test_namelist_of_a_legacy_pair_keeps_the_record(self):
        self.write("two.nml", MODEL + "&quake record = 'record.csv', column = 'n' /")
        outcome = self.run_program("check", "--as-namelist", "two.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertRegex(outcome.out, r"&quake[^/]*column = 'n'[^/]*record = '[^']*record\.csv'")
        self.assertEqual(len(re.findall("&quake", outcome.out)), 1)


if __name__ == "__main__":
    unittest.main()
