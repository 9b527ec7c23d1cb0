# SPDX-License-Identifier: MIT
"""One fault, one message, and it names the fix: words of the field, malformed numbers, lists, weight, damping."""

from support import ProgramTest

LINES = "0.001\n4 4\n0 0 0 0 0 0\n0 0 4 0 1\n4 0 4 2 1\n4 2 0 2 1\n0 2 0 0 1\n"
MODEL = """\
&model geometry = 'a.dc' /
&block_material number = 1, density = 2600, young = 20e9, poisson = 0.25 /
&joint_material number = 1, friction = 38 /
&load gravity = 9.81 /
&boundary along = 0,0, 4,0, kind = 'fixed' /
&run steps = 1 /
"""


class Messages(ProgramTest):
    def problems(self, *changes, level="error"):
        text = MODEL
        for old, new in changes:
            self.assertIn(old, text)
            text = text.replace(old, new)
        self.write("a.dc", LINES)
        self.write("a.nml", text)
        outcome = self.run_program("check", "a.nml")
        mark = f" {level}: "
        return [line.split(mark)[1] for line in outcome.err.splitlines() if mark in line]

    def test_words_of_the_field_lead_to_the_option(self):
        for word, name, group in (
            ("phi", "friction", "joint_material"),
            ("mu", "friction", "joint_material"),
            ("E", "young", "block_material"),
            ("nu", "poisson", "block_material"),
            ("rho", "density", "block_material"),
            ("g", "gravity", "load"),
        ):
            with self.subTest(word=word):
                found = self.problems((f"{name} =", f"{word} ="))
                self.assertEqual(
                    found, [f"unknown name '{word.lower()}' in &{group}; did you mean '{name}'?"][: len(found)]
                )
                self.assertEqual(len(found), 1)

    def test_an_option_in_two_groups_is_told_with_both_places(self):
        run = "&run steps = 1 /\n"
        again = "gravity: given again in another &load, the last one counts; before: a.nml:4:7"
        self.assertEqual(self.problems((run, run + "&load gravity = 5 /\n"), level="warning"), [again])
        more = "&contact formulation = 'length' /\n&contact stiffness = 1e10 /\n"
        self.assertEqual(self.problems((run, run + more), level="warning"), [])

    def test_a_change_that_is_given_again_in_its_stage_is_told(self):
        stages = "&stage name = 'a', until = 'equilibrium' /\n&stage name = 'b', until = 'equilibrium' /\n"
        region = "&region name = '{0}', box = 0,0, 4,2 /\n"
        joint = "&change stage = '{}', joint_material = {}, {} /\n"
        block = "&change stage = '{}', {}, {} /\n"
        base = stages + region.format("p") + region.format("q")

        def told(first, second):
            text = first + base + second
            return self.problems(
                ("&run steps = 1 /\n", text),
                ("number = 1, friction", "number = 1, name = 'j', friction"),
                level="warning",
            )

        friction = "friction of the same material"
        young = block.format("b", "region = 'p'", "young = 1e9")
        for first, second, names in (
            (joint.format("b", 1, "friction = 20"), joint.format("B", "'j'", "friction = 30"), friction),
            (joint.format("b", 1, "friction = 20"), joint.format("a", 1, "friction = 30"), ""),
            (joint.format("b", 1, "friction = 20"), joint.format("b", 1, "cohesion = 3e3"), ""),
            (young, block.format("b", "region = 'q, p'", "young = 2e9"), "young of the same region"),
            (young, block.format("b", "region = 'q'", "young = 2e9"), ""),
            (young, block.format("b", "block_material = 1", "young = 2e9"), ""),
        ):
            with self.subTest(first=first, second=second):
                text = f"&change: {names} is given again in the stage, the last one counts; before: a.nml:6:1"
                self.assertEqual(told(first, second), [text] if names else [])

    def test_an_acceleration_as_the_factor_of_a_stage_is_told(self):
        for factor, told in ((9.81, 1), (3, 0), (0.5, 0), (-1, 0)):
            stage = f"&stage gravity = {factor}, until = 'equilibrium' /\n"
            found = self.problems(("&run steps = 1 /\n", stage), level="warning")
            self.assertEqual(["is a factor on the weight, not an acceleration" in one for one in found], [True] * told)

    def test_joints_that_no_test_gives_are_told(self):
        def told(more):
            return self.problems(("friction = 38", more), level="warning")

        law = "law = 'barton_bandis', jcs = 50e6, residual_friction = 25, jrc = {}"
        self.assertEqual(told(law.format(25)), ["joint material 1: jrc = 25: the roughest profile has 20"])
        self.assertEqual(told(law.format(20)), [])
        apex = "joint material 1: tension = 100 kPa is more than cohesion/tan(friction) = 12.8 kPa, where no shear "
        bond = "friction = 38, cohesion = {}, tension = {}"
        self.assertEqual(told(bond.format("1e4", "1e5")), [apex + "strength is left"])
        self.assertEqual(told(bond.format("1e5", "1.28e5")), [])
        self.assertEqual(told(bond.format("1e4", "1e5").replace("38", "0")), [])

    def test_a_malformed_value_is_not_missing_too(self):
        self.assertEqual(
            self.problems(("friction = 38", "friction = 38x")), ["friction: expected a number, found '38x'"]
        )
        self.assertEqual(
            self.problems(("density = 2600", "density = 26x0")), ["density: expected a number, found '26x0'"]
        )
        # the others are
        self.assertEqual(
            self.problems(("density = 2600, young = 20e9, ", "density = 26x0, ")),
            ["density: expected a number, found '26x0'", "block material 1: 'young' is missing"],
        )

    def test_a_negative_friction_is_not_too_small_for_the_dilation_too(self):
        (found,) = self.problems(("friction = 38", "friction = -5"))
        self.assertIn("friction: must be", found)

    def test_a_list_of_names_has_its_commas_inside_the_quotes(self):
        (found,) = self.problems(
            ("&run", "&water name = 'w', table = 0,1, unit_weight = 9810, joints = 'a', 'b' /\n&run")
        )
        self.assertIn("joints: expected one text, found 2 values; a list of names is one text, with the commas", found)

    def test_blocks_without_weight_lead_to_the_gravity(self):
        gravity = ("&load gravity = 9.81 /\n", "")
        (found,) = self.problems(gravity, level="warning")
        self.assertIn("write &load gravity = 9.81 /", found)
        # whatever else acts
        along = "&boundary along = 0,2, 4,2, kind = 'traction', pressure = 1e5 /\n&run"
        self.assertIn("write &load gravity = 9.81 /", self.problems(gravity, ("&run", along), level="warning")[0])
        # 0 is an answer
        self.assertEqual(self.problems(("9.81", "0"), ("&run", along), level="warning"), [])

    def test_check_with_a_config_file_read_memory_that_was_not_its_own(self):
        """`check MODEL.dc MODEL.df --config FILE` lost the names of the files, or ended with an internal error."""
        self.write("b.dc", LINES)
        self.write("b.df", "1\n10\n1\n1\n0.01\n0.01\n1e9\n2500 25000 1e9 .2 0 0 0 0 0 0 0 0 0\n30 0 0\n1.4\n")
        for name in ("a.nml", "a_name_of_an_options_file_of_some_length_that_is_longer_than_all_the_others.nml"):
            self.write(name, "&time dt_min = -1 /\n")
            outcome = self.run_program("check", "b.dc", "b.df", "--config", name)
            self.assertEqual(outcome.code, 2)
            self.assertIn(f"{name}:1:16: error: dt_min", outcome.err)
            self.assertNotIn("no such file", outcome.err)

    def test_a_line_without_length_is_one_warning(self):
        self.write("b.dc", LINES.replace("4 4", "5 4") + "1 1 1 1 1\n")
        outcome = self.run_program("check", "b.dc")
        self.assertEqual(outcome.err.count("warning"), 1, outcome.err)

    def test_joints_without_damping_on_a_base_that_moves_are_named(self):
        shaken = (
            "&load gravity = 9.81",
            "&load gravity = 9.81, harmonic = 1, 0, 2, 0, 0 /\n&contact sliding_damping = 0",
        )
        (found,) = [m for m in self.problems(shaken, level="warning") if "damping" in m]
        self.assertIn("the base moves, and joint material 1 has no damping_ratio", found)
        damped = ("friction = 38", "friction = 38, damping_ratio = 0.5")
        self.assertEqual([m for m in self.problems(shaken, damped, level="warning") if "damping" in m], [])
        # contacts that slide are damped by default
        slides = (shaken[0], shaken[1].replace("sliding_damping = 0", ""))
        self.assertEqual([m for m in self.problems(slides, level="warning") if "damping" in m], [])

    def test_help_on_what_stands_elsewhere(self):
        for word, where in (
            ("hole", "stand in the geometry file"),
            ("phi", "did you mean 'friction'"),
        ):
            self.assertIn(where, self.run_program("help", word).err)
        self.assertIn("&opening in a file of joint statistics (.dl): ", self.run_program("help", "opening").out)

    def test_a_surcharge_that_no_pressure_along_the_top_carries_is_told(self):
        ground = "&in_situ surface = 2, k0 = 0.5, surcharge = 1e5 /\n"
        for pressure, told in ((None, True), (1e5, False), (1.01e5, False), (2e5, True)):
            top = f"&boundary along = 0,2, 4,2, kind = 'traction', pressure = {pressure} /\n" if pressure else ""
            found = self.problems(("&run", ground + top + "&run"), level="warning")
            expected = "give a stress of 100 kPa at the top of the model, y = 2 m, "
            self.assertEqual([expected in m for m in found], [True] * told, found)

    def test_a_dash_before_a_number_is_named(self):
        for sign in ("\u2212", "\u2013"):
            found = self.problems(("&run", f"&load gravity = {sign}9.81 /\n&run"))
            self.assertEqual(found, [f"gravity: expected a number, found '{sign}9.81'; its sign is a dash, write '-'"])

    def test_a_reset_in_the_first_stage_is_told(self):
        stages = "&stage until = 'equilibrium', reset_displacement = .true. /\n&stage until = 'equilibrium' /\n"
        found = self.problems(("&run steps = 1 /\n", stages), level="note")
        self.assertEqual([m for m in found if "reset_displacement has no effect in the first stage" in m][1:], [])
        self.assertTrue(any("reset_displacement has no effect in the first stage" in m for m in found))

    def test_a_splinter_between_joints_that_nearly_coincide_is_named_with_its_place(self):
        self.problems()
        self.write("a.dc", LINES.replace("4 4", "6 4") + "-1 1 5 1 1\n-1 1.003 5 1.003 1\n")
        outcome = self.run_program("check", "a.nml")
        (found,) = [line for line in outcome.err.splitlines() if "splinter" in line]
        self.assertRegex(found, r"warning: block \d at \(2, 1.0015\) is 3 mm thick: a splinter between joints")
