# SPDX-License-Identifier: MIT
"""Every judgement of a model before its run gives the message that docs/notes/checks.md has."""

import os
import re
import subprocess
import unittest
from pathlib import Path

from check_cases import SUBJECTS
from support import PROGRAM

ROOT = Path(__file__).resolve().parents[2]


class Checks(unittest.TestCase):
    def test_the_page_has_the_messages_of_the_program(self):
        page = (ROOT / "docs/notes/checks.md").read_text(encoding="utf-8")
        made = subprocess.run(
            [ROOT / "scripts/checks_table", "--print"],
            env={**os.environ, "ROCKDDA_PROGRAM": str(Path(PROGRAM).resolve())},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        table = re.search(r"<!-- table of checks [^\n]*-->\n(.*?)<!-- end of the table -->", page, re.DOTALL)[1]
        for row, expected in zip(table.splitlines(), made.splitlines(), strict=False):
            self.assertEqual(row, expected, "run scripts/checks_table")
        self.assertEqual(table, made, "run scripts/checks_table")

    def test_each_judgement_is_in_the_file_that_the_page_names(self):
        for subject in SUBJECTS:
            for case in subject.cases:
                self.assertTrue((ROOT / "src" / case.file).is_file(), case.file)

    def test_every_file_of_checks_is_in_the_page(self):
        named = {case.file for subject in SUBJECTS for case in subject.cases}
        makes = re.compile(r"severity%|call fail\(|call self%warn\(")
        for path in sorted((ROOT / "src/check").rglob("*.f90")):
            if makes.search(path.read_text(encoding="utf-8")):
                self.assertIn(path.relative_to(ROOT / "src").as_posix(), named)


if __name__ == "__main__":
    unittest.main()
