# SPDX-License-Identifier: MIT
"""Which blocks belong to a region: those with more than half of their area inside; and what is said of the others."""

from pathlib import Path

from support import ProgramTest

# a rock of 20 x 20 without joints around an opening of 6 x 6
LINES = """\
-10 -10 10 -10 1
10 -10 10 10 1
10 10 -10 10 1
-10 10 -10 -10 1
-3 -3 3 -3 1
3 -3 3 3 1
3 3 -3 3 1
-3 3 -3 -3 1
"""
# joints from the opening to the sides, and a block that wraps round its lower right corner
JOINTS = """\
2.2 -3.0 3.4 -3.4 1
3.0 -2.2 3.4 -3.4 1
-10 -3 -3 -3 1
3 3 10 3 1
"""
MODEL = """\
&model geometry = 'rock.dc' /
&block_material number = 1, density = 2600, young = 20e9, poisson = 0.25 /
&joint_material number = 1, friction = 40 /
&load gravity = 9.81 /
&boundary along = -10,-10, 10,-10, kind = 'fixed' /
&run steps = 1 /
"""


class Regions(ProgramTest):
    def check(self, regions, lines=LINES):
        """Blocks of each region, and the warnings."""
        self.write("rock.dc", f"0.001\n{len(lines.splitlines())} 4\n0 0 0 0 0 0\n{lines}")
        self.write("rock.nml", MODEL + regions)
        outcome = self.run_program("check", "rock.nml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        areas = {entry["name"]: entry["blocks"] for entry in outcome.json["regions"]}
        warnings = [m["message"] for m in outcome.json["messages"] if m["severity"] == "warning"]
        return areas, [text for text in warnings if "region" in text]

    def test_the_rock_around_an_opening_is_not_in_it_though_its_centroid_is(self):
        tunnel = "&region name = 'tunnel', polygon = -3,-3, 3,-3, 3,3, -3,3 /\n"
        blocks, warnings = self.check(tunnel)
        self.assertEqual((blocks, warnings), ({"tunnel": [2]}, []))
        blocks, warnings = self.check(tunnel, LINES + JOINTS)
        self.assertEqual((blocks, warnings), ({"tunnel": [3]}, []))

    def test_groups_of_one_name_add_up_their_areas(self):
        halves = "&region name = 'a', box = -3,-3, {0},3 /\n&region name = 'a', box = {1},-3, 3,3 /\n"
        blocks, warnings = self.check(halves.format(0, 0))
        self.assertEqual((blocks, warnings), ({"a": [2]}, []))
        # overlaps count once: 16 of 36
        blocks, warnings = self.check(
            "&region name = 'a', box = -3,-3, -1,3 /\n&region name = 'a', box = -3,-3, -1,3, -1,-3, -0.333333,3 /\n"
        )
        self.assertEqual(blocks, {"a": []})
        self.assertIn("44.4 % of its area inside: no part of it belongs to the region", warnings[-1])

    def test_exactly_half_is_not_more_than_half(self):
        blocks, _ = self.check("&region name = 'half', box = -3,-3, 0,3 /\n")
        self.assertEqual(blocks, {"half": []})

    def test_blocks_that_an_outline_cuts_are_named_with_their_place(self):
        blocks, warnings = self.check("&region name = 'wide', box = -3,-3, 2,3 /\n")
        self.assertEqual(blocks, {"wide": [2]})
        self.assertEqual(
            warnings,
            [
                "the outline of region 'wide' cuts block 2 at (0, 0) with 83.3 % of its area inside: the whole block "
                "belongs to the region; draw the outline along joints, or cut the block along it"
            ],
        )
        # 0.5 % on one side is the accuracy of a drawing
        _, warnings = self.check("&region name = 'wide', box = -3,-3, 2.97,3 /\n")
        self.assertEqual(warnings, [])

    def test_the_log_names_the_blocks_that_an_outline_cuts(self):
        self.check("&region name = 'wide', box = -3,-3, 2,3 /\n")
        outcome = self.run_program("run", "rock.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIn("cuts block 2 at (0, 0)", outcome.err)
        self.assertIn("cuts block 2 at (0, 0)", Path(self.path("rock.log")).read_text())

    def test_a_ring_holds_what_lies_within_its_width(self):
        # squares of 2 x 2, two of them as the opening: the ring of width 1.5 has three quarters of the six beside it
        # and the part pi 1.5^2/16 = 0.44 of the four at its corners
        grid = "".join(f"{x} -10 {x} 10 1\n-10 {x} 10 {x} 1\n" for x in range(-10, 11, 2))
        blocks, warnings = self.check(
            "&region name = 'shaft', box = -2,-2, 0,2 /\n&region name = 'ring', outline = 'shaft', width = 1.5 /\n",
            grid,
        )
        self.assertEqual([len(found) for found in blocks.values()], [2, 6])
        self.assertFalse(set(blocks["ring"]) & set(blocks["shaft"]))
        self.assertEqual(len(warnings), 10)

    def test_a_ring_needs_a_region_before_it_and_a_width(self):
        for group, words in (
            ("outline = 'b', width = 1", "there is no region 'b' before it"),
            ("outline = 'a', width = 1", "there is no region 'a' before it"),
            ("outline = 'a'", "give both"),
            ("box = 0,0, 1,1, width = 1", "give both"),
        ):
            self.write("rock.nml", MODEL + f"&region name = 'a', {group} /\n&region name = 'b', box = 0,0, 1,1 /\n")
            self.write("rock.dc", f"0.001\n8 4\n0 0 0 0 0 0\n{LINES}")
            outcome = self.run_program("check", "rock.nml", "--quiet")
            self.assertEqual(outcome.code, 2)
            self.assertIn(words, outcome.err)
