# SPDX-License-Identifier: MIT
"""Small models and a way to run the program on them."""

import json
import os
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

try:
    import h5py
except ImportError:  # tests that look into results are then skipped
    h5py = None

PROGRAM = os.environ.get("ROCKDDA_PROGRAM", os.fspath(Path(__file__).parents[2] / "build" / "bin" / "rockdda"))

# A block 2 x 1 on a base 4 x 1 that is fixed at two points; one loading and one measured point in the block.
GEOMETRY = """\
0.01        # e0
7 4         # lines, boundary lines
0           # material lines
0           # bolts
2           # fixed lines
1           # loading points
1           # measured points
0           # hole points
0 0 4 0 1
4 0 4 1 1
4 1 0 1 1
0 1 0 0 1
1 1 1 2 1
1 2 3 2 1
3 2 3 1 1
0.5 0.5 0.5 0.5
3.5 0.5 3.5 0.5
2 1.5
2 1.5
"""

# Dialect g0: two fixed points without and one loading point with two time-dependent rows.
ANALYSIS = """\
1           ! dynamic
20          ! steps
1 1         ! block and joint materials
0.01        ! g2
0.01        ! g1
1e8         ! g0
0 0 2       ! rows of each point
0 0 0
1 1000 0
1000 9810 1e8 0.2
0 0 0
0 0 0
0 0 0
30 0 0
1.4
"""

# The same in the dialect of DDA for Windows.
PEER_ANALYSIS = """\
1 20 1 1 0.01 0.01
1000 9810 1e8 0.2  0 0 0  0 0 0  0 0 0
30 0 0
"""


class Outcome:
    """What a call of the program gave."""

    def __init__(self, process):
        self.code = process.returncode
        self.out = process.stdout.decode("utf-8", "surrogateescape")
        self.err = process.stderr.decode("utf-8", "surrogateescape")

    @property
    def json(self):
        return json.loads(self.out)


def hear_interrupts():
    """SIGINT has its usual effect in a new process, also when these tests run in the background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class ProgramTest(unittest.TestCase):
    """Every test works in a fresh folder that holds block.dc and block.df."""

    parent = None  # where that folder is made

    def setUp(self):
        folder = tempfile.TemporaryDirectory(dir=self.parent)
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.write("block.dc", GEOMETRY)
        self.write("block.df", ANALYSIS)

    def path(self, name):
        return self.folder / name

    def write(self, name, text):
        path = self.path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    def run_program(self, *arguments, **options):
        options.setdefault("cwd", self.folder)
        options.setdefault("timeout", 120)
        process = subprocess.run(
            [PROGRAM, *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=options.pop("stdout", subprocess.PIPE),
            stderr=subprocess.PIPE,
            **options,
        )
        if process.stdout is None:
            process.stdout = b""
        return Outcome(process)

    def as_nobody(self):
        """Options of `run_program` with which permissions count: root may read and write everything."""
        if os.geteuid() != 0:
            return {}
        options = {"user": 65534, "group": 65534, "extra_groups": []}
        self.folder.chmod(0o777)
        try:
            code = subprocess.run([PROGRAM, "--version"], cwd=self.folder, capture_output=True, **options).returncode
        except OSError:
            code = 1
        if code != 0:
            self.skipTest("only root can start the program where it is")
        return options

    def start_program(self, *arguments):
        process = subprocess.Popen(
            [PROGRAM, *map(os.fspath, arguments)],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            preexec_fn=hear_interrupts,
        )

        def end():
            if process.poll() is None:
                process.kill()
            process.communicate()

        self.addCleanup(end)
        return process

    def assertFails(self, outcome, code, *lines):
        """The exit code, and exactly these lines on standard error."""
        self.assertEqual(outcome.err.splitlines(), list(lines))
        self.assertEqual(outcome.code, code)

    def files(self):
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.rglob("*") if p.is_file())
