# SPDX-License-Identifier: MIT
"""The constants that scripts vary are where they look for them."""

import importlib.machinery
import importlib.util
import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from critical_factor import CONSTANTS, ROOT

loader = importlib.machinery.SourceFileLoader("constants", str(ROOT / "scripts/constants"))
constants = importlib.util.module_from_spec(importlib.util.spec_from_loader("constants", loader))
loader.exec_module(constants)


@pytest.mark.parametrize(("file", "name"), [*constants.SUPPORT, *((file, name) for name, file in CONSTANTS.items())])
def test_a_constant_is_in_its_file(file, name):
    text = (ROOT / "src" / f"{file}.f90").read_text(encoding="utf-8")
    assert re.search(rf"parameter\b[^!\n]*:: [^!\n]*\b{name} = [0-9.]", text)
