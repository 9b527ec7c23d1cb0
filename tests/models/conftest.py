# SPDX-License-Identifier: MIT
"""Run the models of inputs/ through the program, each once."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from model_runs import INPUTS, Run, copy_with, find_program, run_program


@pytest.fixture(scope="session")
def program() -> Path:
    path = find_program()
    if path is None:
        pytest.skip("the program is not built (build/bin/rockdda, or the path in ROCKDDA_PROGRAM)")
    return path


@pytest.fixture(scope="session")
def run_model(program, tmp_path_factory):
    """run_model(name, options) -> Run, computed once per session; options are added to those of the model."""
    folder = tmp_path_factory.mktemp("models")
    done: dict[tuple[str, str], Run] = {}

    def run(name: str, options: str = "") -> Run:
        if (name, options) not in done:
            place = folder / str(len(done))
            place.mkdir()
            model = copy_with(name, options, place) if options else INPUTS / name
            results = place / f"{name}.h5"
            outcome = run_program(program, ["run", str(model), "-o", str(results), "--quiet"], place)
            assert outcome.returncode == 0, f"{name}\n{outcome.stdout}{outcome.stderr}"
            done[name, options] = Run(results)
            assert done[name, options].complete == 1
        return done[name, options]

    return run


@pytest.fixture
def near():
    """near(case, computed, expected, limit): compare, relative to the expected value, and say so."""

    def compare(case: str, computed: float, expected: float, limit: float, absolute: bool = False) -> None:
        error = abs(computed - expected) if absolute else abs(computed / expected - 1)
        print(f"VALIDATION | model {case} | {computed:.8g} | {expected:.8g} | {error:.2e} | {limit:.0e}")
        assert error <= limit, f"{case}: {computed:.10g} instead of {expected:.10g}, error {error:.2e} > {limit:.0e}"

    return compare


@pytest.fixture(scope="session")
def models() -> list[str]:
    sys.path.insert(0, str(INPUTS))
    import make_models

    return [make.__name__ for make in make_models.MODELS]
