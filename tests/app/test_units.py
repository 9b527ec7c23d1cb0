# SPDX-License-Identifier: MIT
"""Units of labelled files: what results and texts say, and values that cannot be."""

import re
import unittest
from pathlib import Path

from support import ProgramTest, h5py

MODEL = """\
&model           geometry = 'block.dc' {units} /
&block_material  number = 1, density = {density}, young = {young}, poisson = 0.25 /
&joint_material  number = 1, friction = 30, cohesion = {cohesion}, normal_stiffness = {stiffness},
                 shear_stiffness = {stiffness} /
&load            gravity = {gravity} /
&run             steps = 2 /
"""
SI = {"density": "2600", "young": "20e9", "cohesion": "1e4", "stiffness": "5e9", "gravity": "9.81"}
KN = {"density": "2.6", "young": "20e6", "cohesion": "10", "stiffness": "5e6", "gravity": "9.81"}
MM = {"density": "2.6e-9", "young": "20e3", "cohesion": "0.01", "stiffness": "5", "gravity": "9810"}
WATER = "&water table = 0,3, unit_weight = {} /\n"


def in_millimetres(text):
    """The geometry with all lengths times 1000."""
    lines = []
    for line in text.splitlines():
        values = line.split("#")[0].split()
        if len(values) == 5 or len(values) == 4:
            line = " ".join([*(str(1000 * float(value)) for value in values[:4]), *values[4:]])
        elif len(values) == 2 and lines[2:]:
            line = " ".join(str(1000 * float(value)) for value in values)
        lines.append(line)
    return "\n".join(lines) + "\n"


class Units(ProgramTest):
    def check(self, values, units="", more="", command=("check",)):
        self.write("m.nml", MODEL.format(units=units and f", units = '{units}'", **values) + more)
        return self.run_program(*command, "m.nml")

    def test_systems_are_taken_as_they_are(self):
        for units, values in (("", SI), ("SI", SI), ("si", SI), ("kN", KN), ("none", KN)):
            with self.subTest(units):
                outcome = self.check(values, units)
                self.assertEqual(outcome.code, 0, outcome.err)
        outcome = self.check(SI, "cgs")
        self.assertIn("m.nml:1:50: error: units: must be one of 'SI', 'kN', 'mm', 'none', found 'cgs'", outcome.err)

    def test_warnings_of_a_model_are_the_same_in_all_systems(self):
        """Invariant: warnings and notes name quantities in engineering multiples, but for places in the input."""
        told = []
        soft = {"SI": {"young": "1e6", "stiffness": "1e6"}, "kN": {"young": "1e3", "stiffness": "1e3"},
                "mm": {"young": "1", "stiffness": "0.001"}}  # fmt: skip
        splinter = "0.001\n6 4\n0\n0\n0\n0\n0\n0\n" + "".join(
            f"{x1} {y1} {x2} {y2} 1\n" for x1, y1, x2, y2 in
            ((0, 0, 4, 0), (4, 0, 4, 2), (4, 2, 0, 2), (0, 2, 0, 0), (0, 1, 4, 1), (0, 1.003, 4, 1.003))
        )  # fmt: skip
        for units, values in (("SI", SI), ("kN", KN), ("mm", MM)):
            self.write("block.dc", in_millimetres(splinter) if units == "mm" else splinter)
            outcome = self.check(values | soft[units], units)
            self.assertEqual(outcome.code, 0, outcome.err)
            # what seems to be in another unit is told in those of the file
            said = re.sub(r"m\.nml:\S+ warning: young: .* is unlikely.*\n", "", re.sub(r"\n    .*", "", outcome.err))
            told.append(re.sub(r" at \(\S+ \S+\)", " at PLACE", said))
        self.assertIn("is 3 mm thick", told[0])
        self.assertIn("is 1 MPa: the weight of the model, ", told[0])
        self.assertIn("kN/m³ times its height 2 m", told[0])
        self.assertEqual(told[0], told[1])
        self.assertEqual(told[0], told[2])

    def test_one_model_in_three_systems_is_shown_the_same(self):
        """Invariant: what is shown of a model does not depend on the system it is written in."""
        shown = []
        for units, values in (("SI", SI), ("kN", KN), ("mm", MM)):
            if units == "mm":
                self.write("block.dc", in_millimetres(self.path("block.dc").read_text()))
            outcome = self.check(values, units)
            self.assertEqual(outcome.code, 0, outcome.err)
            shown.append([line for line in outcome.out.splitlines() if not re.match(r"  (units|smallest)", line)])
        facts = "\n".join(shown[0])
        self.assertRegex(facts, r"height +2 m\n")
        self.assertRegex(facts, r"stress at the base +51\.012 kPa\n")
        self.assertIn("unit weight 25.51 kN/m³, E 20000 MPa", facts)
        self.assertIn("friction 30°, cohesion 10 kPa", facts)
        for other in shown[1:]:
            rounded = [re.sub(r"(\d\.\d{4})\d+", r"\1", line) for line in other]
            self.assertEqual(rounded, [re.sub(r"(\d\.\d{4})\d+", r"\1", line) for line in shown[0]])

    def test_a_boundary_beside_the_model_says_how_far(self):
        outcome = self.check(SI, more="&boundary along = 0,30, 2,30, kind = 'fixed' /\n")
        self.assertRegex(outcome.err, r"has both ends within \S+ m?m of the polyline; .*, \S+ m away")

    def test_values_that_are_unlikely_are_warnings(self):
        for changed, more, words in (
            (
                {"cohesion": "200"},
                "",
                "cohesion: 200 Pa is unlikely, usual are 1000 to 1e.08 Pa: it seems to be in kPa, but",
            ),
            ({"gravity": "0.981"}, "", "gravity: 0.981 m/s.2 is unlikely, usual are 9 to 10.5 m/s.2"),
            ({"stiffness": "5000"}, "", "normal_stiffness: 5000 Pa/m is unlikely, .* in MPa/m, but"),
        ):
            with self.subTest(**changed):
                outcome = self.check(SI | changed, "SI", more)
                self.assertEqual(outcome.code, 0, outcome.err)
                self.assertRegex(outcome.err, "warning: " + words)
        self.assertNotIn("unlikely", self.check(SI, "SI").err)

    def test_values_that_cannot_be_are_errors_with_the_cause(self):
        """Each was taken, some with a warning, before units were said."""
        for units, values, changed, more, place, cause in (
            ("SI", SI, {"density": "2.6"}, "", "density", "it seems to be in t/m3"),
            ("kN", KN, {"density": "2600"}, "", "density", "it seems to be in kg/m3"),
            ("mm", MM, {"density": "2600"}, "", "density", "it seems to be in kg/m3"),
            ("SI", SI, {"young": "20e3"}, "", "young", "it seems to be in MPa"),
            ("SI", SI, {"young": "2.1e5"}, "", "young", "it seems to be in MPa"),
            ("SI", SI, {"young": "20"}, "", "young", "it seems to be in GPa"),
            ("kN", KN, {"young": "20e9"}, "", "young", "it seems to be in Pa"),
            ("mm", MM, {"young": "20e9"}, "", "young", "it seems to be in Pa"),
            (
                "SI",
                SI,
                {"cohesion": "10"},
                "",
                "cohesion",
                "in kPa or MPa, but units = 'SI' has Pa, where it is 10000 or 1e+07",
            ),
            ("mm", MM, {"stiffness": "5e9"}, "", "normal_stiffness", "it seems to be in Pa/m"),
            ("mm", MM, {"gravity": "9.81"}, "", "gravity", "it seems to be in m/s2"),
            ("SI", SI, {"gravity": "9810"}, "", "gravity", "it seems to be in mm/s2"),
            ("SI", SI, {}, WATER.format("9.81"), "unit_weight", "it seems to be in kN/m3"),
            ("SI", SI, {}, WATER.format("1000"), "unit_weight", "it seems to be in kg/m3, a density"),
            ("kN", KN, {}, WATER.format("9810"), "unit_weight", "it seems to be in N/m3"),
            ("mm", MM, {}, WATER.format("9.81"), "unit_weight", "it seems to be in kN/m3"),
            ("SI", SI, {}, "&joint_law material = 1, residual_friction = 0.35 /\n", "residual_friction", "in radians"),
            ("SI", SI, {}, "&in_situ stress = -5, -10, 0 /\n", "stress", "it seems to be in MPa"),
            ("SI", SI, {}, "&in_situ surface = 2, k0 = 1, surcharge = 50 /\n", "surcharge", "it seems to be in kPa"),
            ("SI", SI, {}, "&in_situ surface = 2, k0 = 1, unit_weight = 26 /\n", "unit_weight", "in kN/m3"),
            ("SI", SI, {}, "&boundary along = 0,2, 4,2, kind = 'traction', pressure = 0.2 /\n", "pressure", "in MPa"),
            ("SI", SI, {}, "&boundary along = 0,2, 4,2, kind = 'moving', velocity = 0, -5e3 /\n", "velocity", "mm/s"),
            ("SI", SI, {}, "&joint_law material = 1, law = 'barton_bandis', jrc = 8, jcs = 50 /\n", "jcs", "in MPa"),
            ("SI", SI, {}, "&contact stiffness = 20 /\n", "stiffness", "it seems to be in MN/m"),
        ):
            with self.subTest(units=units, **changed, more=more):
                outcome = self.check(values | changed, units, more)
                self.assertEqual(outcome.code, 2, outcome.err)
                found = re.search(rf"m\.nml:\d+:\d+: error: {place}: .*cannot be.*", outcome.err)
                self.assertIsNotNone(found, outcome.err)
                self.assertIn(cause, found[0])
                self.assertIn("units = 'none'", found[0])
                outcome = self.check(values | changed, "none", more)
                self.assertNotIn("cannot be", outcome.err)

    def test_friction_in_radians_names_the_degrees(self):
        self.write("m.nml", MODEL.format(units="", **SI).replace("friction = 30", "friction = 0.6"))
        outcome = self.run_program("run", "m.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("m.nml:3:41: error: friction: 0.6 degrees cannot be: it is in radians, give 34.38", outcome.err)

    def test_values_of_soil_and_foam_are_told(self):
        """26 kg/m3, a weight in kN/m3, and 30 MPa for 30 GPa were taken without a word."""
        for units, values, changed, name, cause in (
            ("SI", SI, {"density": "26"}, "density", "it seems to be in kN/m3, a unit weight, .* where it is 2650"),
            ("SI", SI, {"young": "30e6"}, "young", "it seems to be in kPa, .* where it is 3e\\+10"),
            ("kN", KN, {"young": "30e3"}, "young", "it seems to be in MPa, .* where it is 3e\\+07"),
        ):
            with self.subTest(units=units, **changed):
                outcome = self.check(values | changed, units)
                self.assertEqual(outcome.code, 0, outcome.err)
                self.assertRegex(outcome.err, f"warning: {name}: .* is unlikely, usual are .*: {cause}")
        for sound in ({}, {"density": "2000", "young": "5e7"}, {"density": "500", "young": "1e10"}):
            self.assertNotIn("is unlikely", self.check(SI | sound).err)

    def test_materials_of_all_trades_are_taken(self):
        """Wide bounds: density and E of foam, wood, peat, soil, masonry, concrete, rock, steel, rigid blocks."""
        for density, young in (
            (15, 5e6), (500, 1e10), (1050, 2e5), (2000, 2e7), (1800, 3e9), (2400, 3e10), (3200, 1.2e11),
            (7850, 2.1e11), (19300, 4e11), (2600, 1e13),
        ):  # fmt: skip
            with self.subTest(density=density):
                outcome = self.check(SI | {"density": str(density), "young": str(young)})
                self.assertEqual(outcome.code, 0, outcome.err)
        for gravity in ("0", "1.62", "10", "981"):
            self.assertEqual(self.check(SI | {"gravity": gravity}).code, 0)

    def test_a_table_of_factors_may_multiply_a_pressure_of_one(self):
        more = "&boundary along = 0,2, 4,2, kind = 'traction', pressure = 1, table = 0,0, 1,1e5 /\n"
        self.assertNotIn("cannot be", self.check(SI, more=more).err)

    def test_a_geometry_in_another_unit_of_length(self):
        self.write("block.dc", in_millimetres(in_millimetres(self.path("block.dc").read_text())))
        outcome = self.check(SI)
        self.assertEqual(outcome.code, 2)
        self.assertIn("m wide or high (units = 'SI'), which cannot be: possible are 0.1 mm to 200 km", outcome.err)

    def test_values_of_a_named_analysis_file(self):
        self.write("m.nml", "&model geometry = 'block.dc', analysis = 'block.df', units = 'mm' /\n")
        outcome = self.run_program("check", "m.nml")
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertRegex(outcome.err, r"block\.df: error: block_material 1: density: .*cannot be")
        # the legacy pair itself has no units
        self.assertEqual(self.run_program("check", "block.dc", "block.df").code, 0)

    @unittest.skipUnless(h5py, "needs h5py")
    def test_results_say_their_units(self):
        for units, values, stress, density in (("SI", SI, "Pa", "N/m^3"), ("kN", KN, "kPa", "kN/m^3")):
            weight = {"SI": 9810, "kN": 9.81}[units]
            outcome = self.check(values, units, WATER.format(weight), ("run", "--force"))
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertRegex(outcome.out, r"steps to time [\d.]+ s,")
            with h5py.File(self.path("m.h5")) as file:
                self.assertEqual(file.attrs["units"], units)
                self.assertEqual(file["frames/stress"].attrs["units"], stress)
                self.assertEqual(file["frames/vertices"].attrs["units"], "m")
                self.assertEqual(file["model/water_unit_weight"].attrs["units"], density)
                self.assertEqual(file["frames/velocity"].attrs["units"], "m/s, m/s, 1/s, 1/s, 1/s, 1/s")
                names = []
                file.visit(names.append)
                for name in names:
                    if isinstance(file[name], h5py.Dataset) and file[name].dtype.kind == "f":
                        self.assertIn("units", file[name].attrs, name)
            self.assertRegex(self.run_program("info", "m.h5").out, rf"units +{units} \(")
            self.assertRegex(self.path("m.log").read_text(), rf"units += {units} \(m, ")
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "old.h5").code, 0)
        with h5py.File(self.path("old.h5")) as file:
            self.assertEqual(file.attrs["units"], "none")
            self.assertEqual(file["frames/stress"].attrs["units"], "stress")

    def test_units_of_a_run_that_goes_on(self):
        self.check(SI, command=("run", "--steps", "1", "--force"))
        outcome = self.run_program("resume", "m.ckpt.h5", "--steps", "1")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertRegex(outcome.out, r"2 steps to time [\d.]+ s,")

    def test_a_legacy_pair_as_a_labelled_file_has_no_units(self):
        printed = self.run_program("check", "--as-namelist", "block.dc", "block.df").out
        self.assertRegex(printed, r"&model[^/]*units = 'none'")

    def test_models_of_the_inputs_are_taken(self):
        for path in sorted((Path(__file__).resolve().parents[2] / "inputs").glob("*/*.nml")):
            if "&model" in path.read_text():
                self.assertNotIn("cannot be", self.run_program("check", path).err, path.name)


if __name__ == "__main__":
    unittest.main()
