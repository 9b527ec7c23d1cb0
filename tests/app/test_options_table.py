# SPDX-License-Identifier: MIT
"""The table of run options: what the program prints, the documentation holds and the source spells agree."""

import json
import os
import re
import subprocess
import unittest
from pathlib import Path

from support import PROGRAM, ProgramTest

ROOT = Path(__file__).resolve().parents[2]
# the table and its parts
TABLE = {
    f"{name}.f90"
    for name in (
        "option_table",
        "material_options",
        "joint_options",
        "support_options",
        "bolt_numbers",  # messages that name options
        "region_options",
        "ground_options",
        "stage_options",
        "quake_options",
        "units",  # dimensions
        "possible_values",  # bounds of options by name
    )
}
# words in quotes that are no names of options there: energies, kinds of value and of boundaries, a group of the
# checkpoint
OTHERS = {
    ("checkpoint_model.f90", "block_material"),
    ("state.f90", "gravity"),
    ("state.f90", "friction"),
    ("state.f90", "geometry"),
    ("options.f90", "on"),
    ("options.f90", "stress"),
    ("options.f90", "area"),
    ("geometry_input.f90", "friction"),
    ("options.f90", "base_acceleration"),
    ("labelled_text.f90", "block_material"),
    ("labelled_text.f90", "joint_material"),
    ("labelled_text.f90", "stress"),  # the plane
    ("option_documents.f90", "file"),
    ("option_documents.f90", "number"),
    ("checkpoint_model.f90", "parameters"),
    ("boundary_check.f90", "traction"),
    ("option_reader.f90", "units"),
    ("option_reader.f90", "table"),
    ("option_reader.f90", "water"),
    ("log.f90", "units"),
    ("log.f90", "stress"),
    ("checkpoint_model.f90", "units"),
}


class OptionsTable(ProgramTest):
    def printed(self, *arguments):
        outcome = self.run_program("check", "--options-table", *arguments)
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        return outcome.out

    def test_the_documentation_has_the_table_of_the_program(self):
        text = (ROOT / "docs/file-formats.md").read_text(encoding="utf-8")
        found = re.search(r"<!-- options table [^\n]*-->\n(.*?)<!-- end of options table -->", text, re.DOTALL)
        made = subprocess.run(
            [ROOT / "scripts/options_table", "--print"],
            env={**os.environ, "ROCKDDA_PROGRAM": str(Path(PROGRAM).resolve())},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        self.assertEqual(found[1], made, "run scripts/options_table")
        # the page has every row of the program once
        rows = [row for row in self.printed().splitlines() if row not in found[1]]
        joint = re.search(r"^\| `&joint_material`.*?(?=^\| `&stage`)", found[1], re.M | re.S)[0]
        self.assertEqual([row for row in rows if row not in joint], [])
        self.assertEqual(found[1].count("all others of `&joint_material`"), 2)

    def test_the_schema_of_the_documentation_is_that_of_the_program(self):
        text = (ROOT / "docs/options.schema.json").read_text(encoding="utf-8")
        self.assertEqual(text, self.printed("--json"), "run scripts/options_table")

    def test_every_option_of_the_schema_is_read_and_no_other(self):
        """A value that the schema allows is accepted for each option; each name is known in its own group only."""
        schema = json.loads(self.printed("--json"))
        self.write("motion.csv", "0,0,0.5\n1,1,1\n")
        lines = []
        for group, description in schema["$defs"].items():
            if group in ("stage", "change"):
                continue  # not all of them in one group
            if group == "bolt":
                continue  # what the kinds have: test_bars
            if group == "model":
                continue  # a labelled file, which is checked with the files that it names
            rows = [f"{name} = {self.value(row)}" for name, row in description["properties"].items()]
            if group == "quake":  # a name would have to stand in the header of the file
                rows[list(description["properties"]).index("column")] = "column = 3"
            # the stage that is given below
            lines.append(f"&{group} {', '.join(rows)} /\n".replace("base_stage = 'x'", "base_stage = 's'"))
        lines.append("&stage until_step = 1, k01 = 0, gravity = 1, release = 1 / &stage until_time = 1 /\n")
        lines.append("&stage name = 's', kind = 'static', until = 'equilibrium', tolerance = 1e-4, max_steps = 9,\n")
        lines.append(" on_failure = 'continue', excavate = 'x', relax = 1, relax_steps = 3, place = 'x',\n")
        lines.append(" reset_displacement = .true. /\n&stage duration = 1 /\n")
        joint = schema["$defs"]["joint_law"]["properties"].items()
        rows = [f"{name} = {self.value(row)}" for name, row in joint if name not in ("name", "material")]
        lines.append(f"&change stage = 's', joint_material = 1, {', '.join(rows)} /\n")
        lines.append("&change stage = 's', block_material = 1, density = 1, young = 1, poisson = 0.1 /\n")
        lines.append("&change stage = 's', region = 'x', unit_weight = 1 /\n")
        self.write("all.nml", "".join(lines))
        outcome = self.run_program("check", "all.nml")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        for group in schema["$defs"]:
            self.write("one.nml", f"&{group} zzzzzz = 1 /\n")
            outcome = self.run_program("check", "one.nml")
            self.assertIn(f"error: unknown name 'zzzzzz' in &{group}", outcome.err)

    @staticmethod
    def value(row):
        if row.get("x-file"):
            return "'motion.csv'"
        if "enum" in row:
            return repr(row["enum"][-1])
        if "string" in row["type"]:
            return "'x'"
        if row["type"] == "boolean":
            return ".true."
        if "array" in row["type"]:
            return ", ".join(str(i + 1) for i in range(row.get("minItems", 1)))
        low = row.get("minimum", row.get("exclusiveMinimum", 0) + 0.5)
        return str(low)

    def test_bounds_of_the_schema_are_those_of_the_reader(self):
        schema = json.loads(self.printed("--json"))
        n_tried = 0
        for group, description in schema["$defs"].items():
            for name, row in description["properties"].items():
                outside = [row[key] - 1 for key in ("minimum",) if key in row]
                outside += [row[key] for key in ("exclusiveMinimum", "exclusiveMaximum") if key in row]
                outside += [row[key] + 1 for key in ("maximum",) if key in row]
                for value in outside:
                    self.write("bad.nml", f"&{group} {name} = {value} /\n")
                    outcome = self.run_program("check", "bad.nml")
                    column = len(f"&{group} {name} = ") + 1
                    self.assertRegex(outcome.err, rf"bad\.nml:1:{column}: error: {name}: must ")
                    n_tried += 1
        self.assertGreater(n_tried, 25)

    def test_the_log_has_every_number_that_the_run_uses(self):
        self.write("motion.csv", "0,0,0\n1,2,0.5\n")
        self.write(
            "all.nml",
            "&run steps = 2, max_wall = 500 / &contact open_tolerance = 0.125 /\n"
            "&load base_acceleration = 'motion.csv', harmonic = 1, 0, 2, 0.25, 0.75 /\n"
            "&joint_law material = 1, damping_ratio = 0.1 /\n"
            "&line_load ends = 0, 0, 1, 0, force_start = 0, 3, table = 0, 0, 1, 4 /\n"
            "&stage until_step = 1, release = 1 / &stage k01 = 0 / &output energy = .true. /\n",
        )
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "all.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        log = self.path("block.log").read_text()
        w0 = float(re.search(r"reference length w0 += (\S+)\n", log)[1])
        self.assertIn(f"opening tolerance                  = {0.125 * w0:g}\n", log)
        for text in (
            "base acceleration                  = 2 rows of t, ax, ay: (0 0 0) (1 2 0.5)\n",
            "harmonic base acceleration         = 1 row of ax, ay, f, phase, t0: (1 0 2 0.25 0.75)\n",
            "joint_material 1                   = number 1, friction 30, cohesion 0, tension 0, law coulomb, "
            "dilation 0, damping_ratio 0.1, brittle .true., tie .false.\n",
            "line_load 1                        = ends (0 0 1 0), force_start (0 3), force_end (0 3), "
            "table 2 rows of t, factor: (0 0) (1 4)\n",
            "stage 1                            = tolerance 1e-05, max_steps 5000, until_step 1, gravity 1, "
            "release (1), reset_displacement .false., relax_steps 10\n",
            "stage 2                            = tolerance 1e-05, max_steps 5000, k01 0, gravity 1, "
            "reset_displacement .false., relax_steps 10\n",
            "max_wall                           = 500\n",
            "energy balance                     = .true.\n",
        ):
            self.assertIn("\n  " + text, log)

    def test_the_log_has_the_value_of_what_is_not_given(self):
        def logged(*more):
            self.assertEqual(self.run_program("run", "block.dc", "block.df", "--force", "--quiet", *more).code, 0)
            rows = re.findall(r"^  (\S.*?) += (.*)$", self.path("block.log").read_text(), re.MULTILINE)
            return dict(rows)

        values = logged("--steps", "250", "--threads", "2")
        expected = {"save_every": "2", "save_dt": "none", "threads": "2", "length_scale": "height", "file": "block.h5"}
        self.assertEqual({name: values[name] for name in expected}, expected)
        self.write("time.nml", "&run save_dt = 0.5 / &time length_scale = 'largest' /\n")
        values = logged("--config", "time.nml", "--steps", "2")
        self.assertEqual(
            [values[name] for name in ("save_every", "save_dt", "length_scale")], ["none", "0.5", "largest"]
        )

    def test_what_was_accepted_in_silence(self):
        self.write(
            "bad.nml",
            "&run threads = 100000 /\n&output file = '' /\n&load harmonic = 1, 0, 2, 0, 0, 1, 0, -3, 0, 0 /\n",
        )
        outcome = self.run_program("check", "bad.nml")
        self.assertEqual(outcome.code, 2)
        for text in (
            "bad.nml:1:16: error: threads: must be at least 1 and at most 1024, found '100000'\n",
            "bad.nml:2:16: error: file: must not be empty, found ''\n",
            "bad.nml:3:39: error: harmonic: the frequency must not be negative, found '-3'\n",
        ):
            self.assertIn(text, outcome.err)
        outcome = self.run_program("run", "block.dc", "block.df", "--threads", "100000")
        self.assertEqual(outcome.code, 2)
        self.assertIn("option --threads: must be 1024 or less, found 100000", outcome.err)
        self.write("both.nml", "&run save_every = 3, save_dt = 0.5 /\n")
        outcome = self.run_program("check", "block.dc", "block.df", "both.nml")
        self.assertIn("note: save_every and save_dt are both given: a frame is saved every 3 steps", outcome.err)

    def test_the_old_name_of_dda_windows_is_read(self):
        logs = []
        for word in ("peer", "dda_windows"):
            self.write("run.nml", f"&run steps = 1 / &contact preset = '{word}' /\n")
            outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml", "--force")
            self.assertEqual(outcome.code, 0, outcome.err)
            logs.append(re.findall(r"^  .* = .*$", self.path("block.log").read_text(), re.MULTILINE))
        self.assertEqual(logs[0], logs[1])
        self.assertIn("  contact preset                     = dda_windows", logs[0])
        self.assertIn("  close_tolerance                    = 0.0002", logs[0])

    def test_no_source_but_the_table_spells_an_option(self):
        """Names of options stand in quotes in the table and nowhere else in what reads, writes and logs them."""
        names = {name for group in json.loads(self.printed("--json"))["$defs"].values() for name in group["properties"]}
        names.discard("length")  # a dimension
        sources = [path for folder in ("model", "io/options") for path in (ROOT / "src" / folder).glob("*.f90")]
        sources += [ROOT / "src/io/text/log.f90", ROOT / "src/run/labelled_text.f90"]
        sources += [ROOT / "src/io/storage/checkpoint/checkpoint_model.f90"]
        found = []
        for path in sources:
            # joint statistics have groups and names of their own
            if path.name in TABLE or path.name.startswith("statistics"):
                continue
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                # a checkpoint that is refused names what is wrong in it
                refused = "archive%demand(" in line or "archive%refuse(" in line
                code = line if line.lstrip()[:1] != "!" and not refused else ""
                found += [
                    f"{path.name}:{number}: {word}"
                    for word in re.findall(r"'(\w+)'", code)
                    if word in names and (path.name, word) not in OTHERS
                ]
        self.assertEqual(found, [])


if __name__ == "__main__":
    unittest.main()
