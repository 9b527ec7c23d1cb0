# SPDX-License-Identifier: MIT
"""A sample of the campaign, the same models each time; `scripts/campaign --full` draws thousands."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("hypothesis")
pytest.importorskip("shapely")

from . import drawing, machine, motion
from .bench import Bench, Fault, Run, find_program

PROGRAM = find_program()
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="the program is not built")
HOLD = [kind for kind in machine.KINDS.values() if not kind.known and machine.is_there(kind)]
KNOWN = sorted(machine.KNOWN.glob("*.toml"))
MENDED = sorted(machine.MENDED.glob("*.toml"))


@pytest.mark.parametrize("kind", HOLD, ids=lambda kind: kind.name)
def test_the_program_agrees_with_the_oracle(kind: drawing.Kind) -> None:
    drawn = drawing.draw(kind, kind.sample, 0, PROGRAM)
    faults = [(verdict.values, verdict.fault) for verdict in drawn.verdicts if verdict.fault]
    assert not faults, faults
    assert drawn.tried > 0


@pytest.mark.parametrize("path", MENDED, ids=lambda path: path.stem)
def test_what_was_at_fault_holds(path: Path) -> None:
    """Models by which a kind failed in a campaign, as simple as they became: the first line says what was wrong."""
    assert not machine.again(path, PROGRAM)


@pytest.mark.parametrize("path", KNOWN, ids=lambda path: path.stem)
def test_what_is_known_to_fail_still_fails(path: Path) -> None:
    """Where this fails, the program has learned it: take the word `known` from the kind and delete the file."""
    kind, _ = machine.read_kept(path)
    assert kind.known
    assert machine.again(path, PROGRAM)
    assert len(path.read_text(encoding="utf-8").splitlines()) < 30


def test_every_kind_that_is_known_to_fail_has_a_shrunk_model() -> None:
    known = {name for name, kind in machine.KINDS.items() if kind.known}
    assert {path.stem for path in KNOWN} == known


def test_false_motion_is_found(tmp_path: Path) -> None:
    import h5py

    drawn = {"size": 1.0, "young": 1e9, "friction": 30.0, "joints": 0.0, "step": 0.002, "seed": 1, "count": 3}
    bench = Bench(PROGRAM, tmp_path)
    motion.KINDS[0].judge(drawn, bench)
    with h5py.File(tmp_path / "m" / "m.h5", "r+") as results:
        motion.spoil(results)
    run = Run(0, "", "", tmp_path / "m" / "m.h5")
    found = " ".join(motion.faults_of(run, drawn, groups=3))
    for what in ("residual", "geometry gives", "energy grows", "momentum", "overlap"):
        assert what in found, found


def test_a_fault_is_drawn_shrunk_kept_and_found_again(tmp_path: Path) -> None:
    def wrong(drawn: drawing.Values, bench: Bench) -> None:
        if drawn["x"] > 3 and drawn["y"] > 1.5:
            raise Fault("too large")

    kind = drawing.Kind(
        "wrong", "none", "none", drawing.values(x=drawing.between(0, 10), y=drawing.between(1, 2, 10)), wrong
    )
    found = drawing.shrink(kind, 100, 0, PROGRAM)
    assert found is not None
    verdict, draws = found
    assert verdict.values == {"x": 3.1, "y": 1.6}
    assert draws == drawing.draw(kind, 100, 0, PROGRAM).failed[0]


def test_a_run_that_was_killed_goes_on_after_its_last_whole_line(tmp_path: Path) -> None:
    state = machine.State(PROGRAM, tmp_path)
    state.add(machine.Row("pairs", 0, 25, 1, 7, 1.0, {"size": 1.0}, "too fast"))
    with state.path.open("a") as file:
        file.write('{"kind": "pairs", "chu')
    rest = machine.State(PROGRAM, tmp_path)
    assert rest.rows == state.rows
    told: list[str] = []
    machine.campaign(["run-out"], 2, PROGRAM, rest, 1, told.append)
    machine.campaign(["run-out"], 2, PROGRAM, machine.State(PROGRAM, tmp_path), 1, told.append)
    assert len(told) == 1
    assert "| pairs" not in machine.table(rest)
    assert "| `pairs` |" in machine.table(rest)


def test_a_campaign_with_more_models_draws_those_that_are_missing(tmp_path: Path) -> None:
    told: list[str] = []
    for count in (1, 3, 2, 3):
        machine.campaign(["run-out"], count, PROGRAM, machine.State(PROGRAM, tmp_path), 1, told.append)
    # neither the smaller number nor the same one again
    assert len(told) == 2
    (row,) = machine.State(PROGRAM, tmp_path).rows
    assert (row.count, row.tried) == (3, 3)
