# SPDX-License-Identifier: MIT
"""Records of ground motion against closed forms and independent integrations; the records are synthetic."""

from __future__ import annotations

import json
import math
import random
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rockdda import InputError, plot, records
from rockdda.cli import main

TIME = np.arange(2001) * 0.01


def shaking() -> records.Record:
    envelope = np.exp(-(((TIME - 8) / 3) ** 2))
    waves = 3 * np.sin(2 * np.pi * 1.3 * TIME) + np.sin(2 * np.pi * 4.1 * TIME + 0.5)
    return records.Record(TIME, envelope * waves + 0.02, "shaking")


def pulse() -> records.Record:
    """Acceleration 1 for 1 s, then 0."""
    return records.Record([0, 1, 1, 3], [1, 1, 0, 0])


def test_velocity_and_displacement_of_a_pulse() -> None:
    assert pulse().velocity.tolist() == [0, 1, 1, 1]
    assert pulse().displacement.tolist() == [0, 0.5, 0.5, 2.5]


def test_displacement_of_straight_pieces_is_exact() -> None:
    fine = records.Record(np.linspace(0, 2, 20001), np.interp(np.linspace(0, 2, 20001), [0, 1, 2], [0, 1, -1]))
    coarse = records.Record([0, 1, 2], [0, 1, -1])
    assert coarse.displacement[-1] == pytest.approx(1 / 6 + 1 / 2 + 1 / 6, rel=1e-14)
    assert fine.displacement[-1] == pytest.approx(coarse.displacement[-1], rel=1e-12)


def test_written_record_reads_back_exactly(tmp_path: Path) -> None:
    again = records.read(records.write(shaking(), tmp_path / "a.csv"))
    assert (again.acceleration == shaking().acceleration).all()
    assert (again.time == shaking().time).all()


pytestmark = pytest.mark.usefixtures("native")


def test_a_written_record_keeps_its_unit(tmp_path: Path) -> None:
    """In m/s² where the file named its unit; times a factor of the user, or without a unit, nobody knows it."""
    (tmp_path / "a.csv").write_text("time_ms,acc_g\n0,0.1\n500,0.2\n")
    found = records.read(tmp_path / "a.csv")
    assert found.is_si
    path = records.write(records.correct_baseline(records.cut(found, 0.1), 0), tmp_path / "b.csv")
    assert path.read_text().startswith("t [s],a [m/s2]\n0.0,")
    assert records.read(path).is_si
    for read in (records.read(tmp_path / "a.csv", scale=9810), records.read(records.write(shaking(), path))):
        assert not read.is_si
        assert records.write(read, path).read_text().startswith("t,a\n")


def test_the_command_says_what_it_takes_without_a_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text("t,a\n0,1\n1,2\n2,1\n")
    (tmp_path / "b.csv").write_text("t,a [g]\n0,1\n1,2\n2,1\n")
    for name, options, told in (("a", [], True), ("a", ["--scale", "1"], False), ("b", [], False)):
        code = main(["record", str(tmp_path / f"{name}.csv"), "-o", str(tmp_path / "r.png"), *options])
        assert not code
        assert ("names no unit" in capsys.readouterr().err) == told


@pytest.mark.parametrize("column", ["ns", "NS", 3, "3"])
def test_column_by_name_or_number(tmp_path: Path, column: str | int) -> None:
    path = tmp_path / "a.csv"
    path.write_text('# a station\ntime, EW (cm/s2), "NS"\n0, 1, 10\n0.5, 2, 20\n')
    assert records.read(path, column=column, scale=0.01).acceleration.tolist() == pytest.approx([0.1, 0.2])
    assert records.read(path).acceleration.tolist() == [0.01, 0.02]
    assert records.read(path, scale=1).acceleration.tolist() == [1, 2]


def test_a_record_prints_on_one_line() -> None:
    """All numbers of it were printed."""
    found = records.Record(np.arange(5000) * 0.01, np.sin(np.arange(5000)), "e.csv")
    assert repr(found) == "Record('e.csv', 5000 samples, t = 0 to 49.99, peak 1)"
    assert repr(records.response_spectrum(found, [0.1, 2.0])) == "Spectrum(2 periods to 2, damping 0.05)"


@pytest.mark.parametrize("head", ["NPTS=   7, DT=   .0050 SEC,", "7  0.005  NPTS, DT", "NPTS=7,DT=.005 SEC"])
def test_peer_file(tmp_path: Path, head: str) -> None:
    path = tmp_path / "a.AT2"
    path.write_text(f"PEER\nSomewhere, 1/2/2003\nACCELERATION IN G\n{head}\n .1E-01 -.2E-01 0 0 1\n 2 3\n")
    found = records.read(path)
    assert found.time.tolist() == pytest.approx([0.005 * k for k in range(7)])
    assert found.acceleration.tolist() == pytest.approx([9.81 * a for a in (0.01, -0.02, 0, 0, 1, 2, 3)])


@pytest.mark.parametrize(
    ("name", "text", "line", "column", "what"),
    [
        ("a.csv", "t,a\n0,1\n1,x\n", 3, 3, "expected a number, found 'x'"),
        ("a.csv", "0 1\n1\n", 2, 1, "at least 2 numbers"),
        ("a.csv", "0 1\n1 1\n0.5 1\n", 3, 1, "must not be smaller"),
        ("a.at2", "a\nb\nc\nd\n", 1, 1, "NPTS"),
        ("a.at2", "a\nb\nc\nNPTS= 3, DT= .01\n1 2\n", 5, 4, "2 values, NPTS is 3"),
        ("a.at2", "a\nb\nc\nNPTS= x, DT= .01\n1 2\n", 4, 1, "number of values"),
    ],
)
def test_bad_files_name_the_place(tmp_path: Path, name: str, text: str, line: int, column: int, what: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=what) as caught:
        records.read(path)
    assert (caught.value.line, caught.value.column) == (line, column)


def variants() -> Iterator[tuple[str, bytes, list[list[float]] | None]]:
    """Two hundred records: name, content, and times and values, None where the file is broken."""
    random_ = random.Random(34)
    for k in range(200):
        n, step = random_.randint(2, 30), random_.choice([0.005, 0.01, 0.5])
        values = [random_.randint(-999, 999) / 100 for _ in range(n)]
        times = [i * step for i in range(n)]
        factor, broken = 1.0, k % 4 == 3
        if k % 2:
            unit, factor = random_.choice(
                [("G", 9.81), ("CM/S/S", 0.01), ("m/s2", 1.0), ("GAL", 0.01), ("MM/SEC**2", 1e-3)]
            )
            head = random_.choice([f"NPTS= {n}, DT= {step} SEC", f"DT={step}\nNPTS={n}", f"{n} {step} NPTS, DT"])
            rows = [" ".join(f"{value:.2f}D0" for value in values[i : i + 5]) for i in range(0, n, 5)]
            if broken:
                rows[-1] += random_.choice([" 1.0", "0,5", " x", " nan"])
            text = "\n".join(["PEER", "Estación", f"ACCELERATION IN UNITS OF {unit}", head, *rows])
        else:
            separator = random_.choice([";", "\t", ",", " "])
            rows = [f"{t:.3f}{separator}{value:.2f}{separator}7.5" for t, value in zip(times, values, strict=True)]
            if broken or (separator in ";\t" and random_.random() < 0.5):
                rows = [row.replace(".", ",") for row in rows]
            broken = "," in rows[0] and separator in ", " and "." not in rows[0]
            names = separator.join(["t", "a", "b"])
            text = "\n".join(["# Estación", *([names] if random_.random() < 0.7 else []), *rows])
        text = text.replace("\n", random_.choice(["\n", "\r", "\r\n"])) + random_.choice(["", "\n", "\x1a"])
        data = text.encode(random_.choice(["utf-8", "utf-8-sig", "latin-1", "utf-16"]))
        wanted = None if broken else [times, [factor * value for value in values]]
        yield f"r{k}.{'at2' if k % 2 else 'csv'}", data, wanted


def test_program_and_package_read_the_same_of_200_records(program: str, tmp_path: Path) -> None:
    """The same numbers, or an error at the same place."""
    refused = {}
    for name, data, wanted in variants():
        path = tmp_path / name
        path.write_bytes(data)
        try:
            found = records.read(path)
        except InputError as error:
            assert wanted is None, f"{name}: {error}"
            refused[name] = (error.line, error.column)
        else:
            assert wanted is not None, name
            assert found.time.tolist() == pytest.approx(wanted[0], abs=1e-12)
            assert found.acceleration.tolist() == pytest.approx(wanted[1], rel=1e-14)
    assert 20 < len(refused) < 100
    groups = "".join(f"&quake record = '{name}' /\n" for name, _, _ in variants())
    (tmp_path / "all.nml").write_text(groups)
    done = subprocess.run([program, "check", tmp_path / "all.nml"], capture_output=True, text=True, errors="replace")
    places = re.findall(r"/(r\d+\.\w+):(\d+):(\d+): error", done.stderr)
    told = {name: (int(line), int(column)) for name, line, column in reversed(places)}
    assert {name: refused[name] for name in told} == told
    assert len(told) == min(len(refused), 50) or "more" in done.stderr


def test_cut_keeps_the_straight_lines() -> None:
    part = records.cut(records.Record([0, 1, 2], [0, 2, 0]), 0.5, 1.25)
    assert part.time.tolist() == [0, 0.5, 0.75]
    assert part.acceleration.tolist() == [1, 2, 1.5]
    with pytest.raises(ValueError, match="nothing is left"):
        records.cut(part, 3, 4)


def test_scale_to_a_peak() -> None:
    assert records.scale(shaking(), peak=2.5).peak == pytest.approx(2.5, rel=1e-15)
    with pytest.raises(ValueError, match="one of"):
        records.scale(shaking())


def test_shorter_steps_keep_velocity() -> None:
    fine = records.resample(shaking(), 0.0025)
    assert fine.velocity[::4] == pytest.approx(shaking().velocity, abs=1e-12)


def test_longer_steps_do_not_alias() -> None:
    """A wave above half the new rate must go, one well below it must stay (2 %: the filter's flank)."""
    pytest.importorskip("scipy")
    inside = slice(20, -20)
    high = records.resample(records.Record(TIME, np.sin(2 * np.pi * 18 * TIME)), 0.05)
    low = records.resample(records.Record(TIME, np.sin(2 * np.pi * 2 * TIME)), 0.05)
    assert np.abs(high.acceleration[inside]).max() < 0.01
    assert low.acceleration[inside] == pytest.approx(np.sin(2 * np.pi * 2 * low.time[inside]), abs=0.02)


@pytest.mark.parametrize("degree", [0, 1, 2, 4])
def test_corrected_record_ends_at_rest(degree: int) -> None:
    corrected = records.correct_baseline(shaking(), degree)
    assert shaking().velocity[-1] > 0.3
    assert corrected.velocity[-1] == pytest.approx(0, abs=1e-12)
    if degree:
        assert corrected.displacement[-1] == pytest.approx(0, abs=1e-12)
    assert corrected.peak == pytest.approx(shaking().peak, rel=0.02)


def test_arias_intensity_of_a_pulse_and_a_triangle() -> None:
    assert records.arias_intensity(pulse(), 10) == pytest.approx(math.pi / 20)
    assert records.arias_intensity(records.Record([0, 3], [0, 2]), 10) == pytest.approx(math.pi / 20 * 4)
    assert records.significant_duration(pulse()) == pytest.approx((0.05, 0.95))


def test_spectrum_of_a_step() -> None:
    """Without damping a sudden constant acceleration moves the oscillator to 2 a/ω²; 0.3 %: the points of a period."""
    step = records.Record([0, 10], [1, 1])
    spectrum = records.response_spectrum(step, [0.1, 0.5, 2.0], damping=0)
    assert spectrum.acceleration == pytest.approx([2, 2, 2], rel=3e-3)
    assert spectrum.velocity == pytest.approx(spectrum.acceleration * spectrum.period / (2 * np.pi))


def test_spectrum_against_an_integration() -> None:
    period, damping = 0.7, 0.05
    w = 2 * np.pi / period
    integrate = pytest.importorskip("scipy.integrate")

    def rate(t: float, y: np.ndarray) -> list[float]:
        a = np.interp(t, TIME, shaking().acceleration) if t <= TIME[-1] else 0.0
        return [y[1], -a - 2 * damping * w * y[1] - w * w * y[0]]

    solved = integrate.solve_ivp(rate, (0, TIME[-1] + period), [0, 0], rtol=1e-9, atol=1e-12, max_step=0.005)
    found = records.response_spectrum(shaking(), [period], damping).displacement
    assert found == pytest.approx([np.abs(solved.y[0]).max()], rel=1e-4)


def test_short_and_long_periods() -> None:
    """A stiff oscillator moves with the ground's acceleration, a soft one stays where it is."""
    corrected = records.correct_baseline(shaking())
    spectrum = records.response_spectrum(corrected, [0.01, 200.0])
    assert spectrum.acceleration[0] == pytest.approx(corrected.peak, rel=0.01)
    assert spectrum.displacement[1] == pytest.approx(np.abs(corrected.displacement).max(), rel=0.05)


def test_newmark_block_of_a_pulse() -> None:
    """Newmark (1965): v = (a - y) t, then it stops in v/y: displacement v²/2 (1/(a-y) + 1/y), v = a - y = 0.5."""
    assert records.newmark_displacement(pulse(), 0.5) == pytest.approx(0.5**2 / 2 * (1 / 0.5 + 1 / 0.5), rel=1e-14)


def test_newmark_block_against_small_steps() -> None:
    dt = 2e-5
    speed = slip = 0.0
    for a in np.interp(np.arange(0, 20, dt), TIME, shaking().acceleration):
        if speed > 0 or a > 1.0:
            speed = max(0.0, speed + (a - 1.0) * dt)
            slip += speed * dt
    assert records.newmark_displacement(shaking(), 1.0) == pytest.approx(slip, rel=1e-4)


def test_newmark_block_on_a_slope() -> None:
    """On a plane at its angle of friction a steady a drives the block by a (cos + sin tan φ) along the plane."""
    steady = records.Record([0, 2], [0.5, 0.5])
    angle = math.radians(20)
    rate = 0.5 * (math.cos(angle) + math.sin(angle) * math.tan(angle))
    assert records.newmark_displacement(steady, friction=20, slope=20) == pytest.approx(2 * rate, rel=1e-12)
    back = records.scale(steady, -3)
    assert records.newmark_displacement(back, friction=5, slope=0) == 0
    assert records.newmark_displacement(back, friction=5, slope=0, upslope=True) < -1


def test_command_draws_and_writes(tmp_path: Path) -> None:
    source = records.write(shaking(), tmp_path / "a.csv")
    out, changed = tmp_path / "a.png", tmp_path / "b.csv"
    arguments = ["record", str(source), "-o", str(out), "--baseline", "1", "--write", str(changed), "--json"]
    assert main(arguments) == 0
    assert out.stat().st_size > 10_000
    assert records.read(changed).velocity[-1] == pytest.approx(0, abs=1e-12)


def test_command_gives_facts_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = records.write(pulse(), tmp_path / "a.csv")
    assert main(["record", str(source), "-o", str(tmp_path / "a.png"), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["peak"] == 1
    assert facts["end_velocity"] == 1


@pytest.mark.parametrize(
    ("rows", "options"),
    [
        ("0,1\n1e60,2\n", []),
        ("0,1\n1,inf\n", []),
        ("0,1\n1,1e59\n", ["--scale", "1e10"]),
        ("0,1\n1,2\n", ["--scale", "inf"]),
        ("0,1\n1,2\n", ["--step", "1e-300"]),
        ("0,1\n1,2\n", ["--step", "nan"]),
        ("0,1\n1,2\n", ["--from", "nan", "--to", "0.5"]),
        ("0,1\n1,2\n", ["--baseline", "1000000"]),
    ],
)
def test_absurd_records_and_options_are_bad_input(tmp_path: Path, rows: str, options: list[str]) -> None:
    """They were internal errors, or filled the memory."""
    (tmp_path / "a.csv").write_text(rows)
    assert main(["record", str(tmp_path / "a.csv"), "-o", str(tmp_path / "a.png"), *options]) == 2


def test_spectrum_of_uneven_steps_takes_no_more_of_them(tmp_path: Path) -> None:
    """A step of 1e-9 beside one of 1: a straight line cut in two there is the same line."""
    plain = records.Record([0, 1, 2, 3], [0, 1, -1, 0])
    uneven = records.Record([0, 1, 1 + 1e-9, 2, 3], [0, 1, 1 - 2e-9, -1, 0])
    periods = [0.1, 1.0, 4.0]
    expected = records.response_spectrum(plain, periods).displacement
    assert records.response_spectrum(uneven, periods).displacement == pytest.approx(expected, rel=1e-3)


def test_command_tells_bad_files(tmp_path: Path) -> None:
    assert main(["record", str(tmp_path / "none.csv")]) == 2


def test_picture_of_zeros() -> None:
    axes = plot.record(records.Record([0, 1], [0, 0]))
    assert len(axes) == 5
