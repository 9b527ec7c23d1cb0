# SPDX-License-Identifier: MIT
"""Joint statistics to lines, and on to blocks."""

import unittest

from support import ProgramTest

TUNNEL = """\
&lines seed = 3 /
&boundary window = -20, -16.5, 20, 33.5, frame = 1 /
&joint_set inclination = 0, spacing = 1, randomness = 0.25 /
&joint_set inclination = 90, spacing = 1.5, trace = 25, bridge = 1, avoid_cantilevers = .true. /
&opening shape = 'horseshoe', span = 10, wall_height = 5, arch_height = 5, center = 0, -5 /
&measured points = 0,0, 0,4.5, 0,8.5, 0,13.5, 0,18, 0,23, 0,28 /
"""


class Lines(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("tunnel.dl", TUNNEL)

    def test_an_opening_takes_its_outline_from_a_region(self):
        window = "&boundary window = 0,0, 10,10 /\n"
        options = (
            "&region name = 'Tunnel', polygon = 3,3, 6,3, 6,5, 3,5 /\n&region name = 'shaft', box = 7,7, 8,9 /\n"
            "&region name = 'well', circle = 2,8,1 /\n&region name = 'ring', outline = 'well', width = 1 /\n"
        )
        self.write("rock.nml", options)
        regions = "&opening outline = 'tunnel' /\n&opening outline = 'shaft' /\n&opening outline = 'well' /\n"
        drawn = (
            "&opening shape = 'polygon', vertices = 3,3, 6,3, 6,5, 3,5 /\n"
            "&opening shape = 'rectangle', width = 1, height = 2, center = 7.5,8 /\n"
            "&opening shape = 'circle', radius = 1, center = 2,8 /\n"
        )
        numbers = {}
        for name, text in (("rock", regions), ("drawn", drawn)):
            self.write(f"{name}.dl", window + text)
            self.assertEqual(self.run_program("lines", f"{name}.dl").code, 0)
            lines = self.path(f"{name}.dc").read_text().splitlines()
            numbers[name] = [line for line in lines if line.count(" ") == 4 and "#" not in line]
        self.assertEqual(numbers["rock"], numbers["drawn"])
        # what a stage excavates is rock at the start: the rest, and three blocks inside it
        self.assertEqual(self.run_program("cut", "rock.dc", "--json").json["blocks"], 4)
        for name, rest, message in (
            ("tunel", "", "2:1: error: &opening: outline: no &region 'tunel' in rock.nml: its regions are 'Tunnel', "),
            ("ring", "", "2:1: error: &opening: outline: the region 'ring' of rock.nml is not drawn by one polygon, "),
            ("well", ", radius = 1", "2:1: error: &opening: 'radius' does not go with 'outline'"),
        ):
            with self.subTest(name=name):
                self.write("bad.dl", window + f"&opening outline = '{name}', file = 'rock.nml'{rest} /\n")
                outcome = self.run_program("lines", "bad.dl")
                self.assertEqual(outcome.code, 2)
                self.assertIn("bad.dl:" + message, outcome.err)

    def test_an_opening_and_its_region_are_drawn_as_the_region(self):
        self.write("rock.dl", "&boundary window = 0,0, 10,10 /\n&opening name = 't', shape = 'circle', radius = 2 /\n")
        outcome = self.run_program("lines", "rock.dl")
        self.assertEqual(outcome.code, 2)
        self.assertIn("2:10: error: unknown name 'name' in &opening; draw it as &region of the options", outcome.err)
        self.write("run.nml", "&model geometry = 'block.dc' /\n&region name = 't', outline = 'tunnel' /\n")
        outcome = self.run_program("check", "run.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("have one outline where the region is drawn and the &opening", outcome.err)

    def test_rings_may_repeat_their_first_vertex(self):
        """As maps write them; the outline was said to touch itself."""
        self.write("ring.csv", "x,y\n3,3\n6,3\n6,5\n3,5\n3,3\n")
        self.write("rock.nml", "&region name = 'tunnel', polygon = 3,3, 6,3, 6,5, 3,5, 3,3 /\n")
        texts = []
        for k, (last, opening) in enumerate(
            (
                ("", "shape = 'polygon', vertices = 3,3, 6,3, 6,5, 3,5"),
                (",0,0", "shape = 'polygon', vertices = 3,3,6,3,6,5,3,5,3,3"),
                (",0,0", "shape = 'polygon', file = 'ring.csv'"),
                ("", "outline = 'tunnel', file = 'rock.nml'"),
            )
        ):
            corners = f"0,0,10,0,10,10,0,10{last}"
            self.write("r.dl", f"&boundary vertices = {corners} /\n&joint_set inclination = 10, spacing = 2 /\n"
                               f"&opening {opening} /\n")  # fmt: skip
            outcome = self.run_program("lines", "r.dl", "-o", f"r{k}.dc")
            self.assertEqual(outcome.code, 0, outcome.err)
            lines = self.path(f"r{k}.dc").read_text().splitlines()
            texts.append([line for line in lines if line.count(" ") == 4 and "#" not in line])
        self.assertEqual(texts[1:], [texts[0]] * 3)

    def test_lines_are_cut_into_blocks(self):
        outcome = self.run_program("lines", "tunnel.dl")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        self.assertTrue(outcome.out.startswith("tunnel.dc: "), outcome.out)
        self.assertIn("spacing 1.5 +- 0 (wanted: 1.5)", outcome.out)
        self.assertIn("trace 25 +- 0 (wanted: 25)", outcome.out)
        self.assertIn("bridge 1 +- 0 (wanted: 1)", outcome.out)
        drawn = self.run_program("lines", "tunnel.dl", "--json", "--force").json
        cut = self.run_program("cut", "tunnel.dc", "--json", "--quiet").json
        # about 1100 blocks; rock and frame fill the window, and the opening is one hole
        self.assertGreater(cut["blocks"], 1000)
        self.assertEqual(cut["holes"], 1)
        self.assertEqual(cut["measured_points"], 7)
        self.assertEqual(cut["fixed_points"], 12)
        frame = 42 * 52 - 40 * 50
        # sums of a thousand areas
        self.assertAlmostEqual(cut["area_of_blocks"], drawn["rock_area"] + frame, delta=1e-8)

    def test_same_seed_same_lines(self):
        texts = {}
        for seed in ("1", "2", "1", None, "3"):
            arguments = ["lines", "tunnel.dl", "--force", "--quiet"]
            self.assertEqual(self.run_program(*arguments, *(["--seed", seed] if seed else [])).code, 0)
            text = self.path("tunnel.dc").read_text()
            self.assertEqual(texts.setdefault(seed, text), text)
        self.assertEqual(texts[None], texts["3"])
        self.assertNotEqual(texts["1"], texts["2"])

    def test_lines_do_not_depend_on_the_machine(self):
        """Three lines of the second set, whose law uses a logarithm and a cosine, as they were drawn elsewhere."""
        text = "&boundary window = 0,0,10,10 / &joint_set inclination = 90, spacing = 2, randomness = 0.4,"
        self.write("x.dl", text + " distribution = 'normal' /")
        self.assertEqual(self.run_program("lines", "x.dl", "-o", "x.dc").code, 0)
        rows = [line.split() for line in self.path("x.dc").read_text().splitlines()]
        self.assertEqual([row[0] for row in rows if len(row) == 5 and row[0] == row[2]][2:5], EXPECTED)

    def test_bad_statistics(self):
        self.write("bad.dl", "&boundary window = 0,0,1,1 /\n&joint_set inclination = 0, spacing = 0 /\n")
        for command in ("lines", "check"):
            outcome = self.run_program(command, "bad.dl")
            self.assertFails(
                outcome,
                2,
                "bad.dl:2:39: error: spacing: must be greater than 0, found '0'",
                "    &joint_set inclination = 0, spacing = 0 /",
                "                                          ^",
            )
        self.assertFalse(self.path("bad.dc").exists())

    def test_usage(self):
        self.write("tunnel.dc", "mine")
        self.assertFails(
            self.run_program("lines", "tunnel.dl"),
            2,
            "rockdda: error: tunnel.dc: the file exists; use --force to overwrite it",
        )
        self.assertFails(
            self.run_program("lines", "tunnel.dl", "-o", "tunnel.dl", "--force"),
            2,
            "rockdda: error: tunnel.dl: the output would overwrite the input",
        )
        self.assertFails(
            self.run_program("lines", "block.dc"),
            2,
            "block.dc: error: expected a joint statistics file, found a geometry file",
        )
        self.assertFails(
            self.run_program("lines", "tunnel.dl", "--seed", "-1"),
            2,
            "rockdda: error: option --seed: must be 0 or more, found -1",
        )
        self.assertFails(
            self.run_program("lines", "tunnel.dl", "--seed", "99999999999"),
            2,
            "rockdda: error: option --seed: must be 2147483646 or less, found 99999999999",
        )
        self.assertFails(
            self.run_program("cut", "block.dc", "--seed", "1"),
            2,
            "rockdda: error: option --seed does not belong to 'rockdda cut'",
        )
        self.assertIn("--seed N", self.run_program("lines", "--help").out)

    def test_info(self):
        outcome = self.run_program("info", "tunnel.dl")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        self.assertRegex(outcome.out, r"joint sets +2\n")
        self.assertRegex(outcome.out, r"spacing 2 +1.5\n")


# Drawn with glibc 2.36 on x86-64.
EXPECTED = ["9.87069649463", "7.57935204394", "7.44386781496"]

if __name__ == "__main__":
    unittest.main()
