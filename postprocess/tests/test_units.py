# SPDX-License-Identifier: MIT
"""Units: what a picture shows is in the units that it names, or there is no picture."""

import re
import shutil

import h5py
import numpy as np
import pytest
import rockdda
from places import ROOT
from rockdda import cli
from rockdda import units as tables
from rockdda.frames import FIELDS
from rockdda.plot.style import DIMENSIONS
from rockdda.storage.tables import TABLES
from rockdda.units import check_units, in_units
from synthetic import write_wall

ANALYSIS = """\
1   # k01
10 2 1 0.01 0.005  ! steps, materials, g2, g1
{g0}
{density} {weight} {modulus} 0.25  0 0 0  0 0 0  0 0 0
{density} {weight} {modulus} 0.25  0 0 0  0 0 0  0 0 0
35 0 0 {omega}
"""


def write_results(path, density, weight, g0="", omega=""):
    write_wall(path, 3, 2)
    text = ANALYSIS.format(density=density, weight=weight, modulus=2e6 * density, g0=g0, omega=omega)
    with h5py.File(path, "r+") as file:
        del file["input/analysis"]
        file["input/analysis"] = text
    return path


# names of dimensions in the program, as the table of options has them
NAMES = {
    "length": "length", "area": "length^2", "time": "time", "density": "mass/length^2", "weight": "force/length^2",
    "stress": "stress", "stiffness": "stress/length", "force": "force", "energy": "energy", "speed": "length/time",
    "acceleration": "length/time^2", "line_load": "force/length", "frequency": "1/time",
}  # fmt: skip


def number(text):
    return float(text.replace("_wp", ""))


@pytest.mark.parametrize(
    ("system", "bolt", "normal", "moment"),
    [("SI", 43.63e3, 8.476e3, 6.208e3), ("kN", 43.63, 8.476, 6.208), ("mm", 43.63e3, 8.476, 6.208e3)],
)
def test_forces_of_bolts_and_linings_in_each_system(system, bolt, normal, moment):
    """A bolt of 43.63 kN; 8.476 kN and 6.208 kNm per metre of thickness, in the file's units for a unit of it."""
    units = tables.Units(*tables.SYSTEMS[system], multiples=True)
    shown = (
        (bolt, units.of_bolt(True, bolt), 43.63, "kN"),
        (normal, units.of_section("N", normal), 8.476, "kN/m"),
        (moment, units.of_section("M", moment), 6.208, "kNm/m"),
    )
    for value, (factor, unit), expected, name in shown:
        assert unit == name
        assert factor * value == pytest.approx(expected, rel=1e-12)


def test_the_program_and_the_package_have_the_same_units():
    """The rows of both tables, and the powers of length, mass and time of each quantity."""
    text = (ROOT / "src/model/data/units.f90").read_text()
    characters = {"squared": "²", "cubed": "³", "degree": "°"}
    multiples = {}
    for dimension, name, more, size, least in re.findall(
        r"multiple_type\('([^']+)', '([^']+)'(?://(\w+))?, (\S+), (\S+)\)", text
    ):
        row = (name + characters.get(more, ""), number(size), number(least))
        multiples[dimension] = (*multiples.get(dimension, ()), row)
    assert {name: multiples[NAMES[name]] for name in NAMES} == {name: tables.MULTIPLES[name] for name in NAMES}
    powers = {}
    for names, row in re.findall(r"case \(([^)]+)\); powers = \[([^]]+)\]", text):
        powers |= dict.fromkeys(re.findall(r"'([^']+)'", names), tuple(map(int, row.split(","))))
    for name in NAMES:
        length, time, force = tables.DIMENSIONS[name]
        assert powers[NAMES[name]] == (length + force, force, time - 2 * force), name
    systems = re.findall(r"unit_system_type\('(\w+)', (\S+), (\S+), (\S+), '(\w+)', '(\w+)', '(\w+)', '(\w+)'\)", text)
    assert {row[0] for row in systems} == set(tables.SYSTEMS)
    for name, *sizes, length, mass, force, stress in systems:
        metres, kilograms, seconds = map(number, sizes)
        assert tables.SYSTEMS[name] == (length, "s", force)
        newtons = kilograms * metres / seconds**2
        assert (tables.LENGTHS[length], tables.TIMES["s"]) == (metres, seconds)
        assert tables.FORCES[force] == pytest.approx(newtons, rel=1e-15)
        assert tables.PASCALS[force, length] == stress
        assert tables.description(name) == f"{name} ({length}, {mass}, s, {force}, {stress})"


def test_results_state_the_unit_of_a_dataset(tmp_path):
    results = rockdda.open(write_results(tmp_path / "a.h5", 2500, 24525))
    assert (results.units, results.units_of("model/vertices")) == ("none", "")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs["units"] = "mm"
        file["model/vertices"].attrs["units"] = "mm"
    results = rockdda.open(tmp_path / "a.h5")
    assert (results.units, results.units_of("model/vertices")) == ("mm", "mm")
    assert " mm (last frame)" in results._repr_html_()


@pytest.mark.parametrize(("g0", "omega"), [("", ""), ("", "1.4"), ("0\n0 0 0\n", "1.4"), ("1e9", "")])
def test_newtons_are_not_called_kilonewtons(tmp_path, monkeypatch, capsys, g0, omega):
    monkeypatch.chdir(tmp_path)
    write_results(tmp_path / "a.h5", 2500, 24525, g0, omega)
    command = ["plot", "a.h5", "--field", "stress_x", "-o", "a.png"]
    assert cli.main([*command, "--units", "m,s,kN"]) == cli.BAD_INPUT
    error = capsys.readouterr().err
    assert "would be 2.5e+06 kg/m³ and 2.45e+07 N/m³; it seems to be in m,s,N. --units states the units of" in error
    assert not (tmp_path / "a.png").exists()
    for units in (["--units", "m,s,N"], ["--units", "SI"], ["--units", "m,s,N", "--show", "mm,ms,kN"], []):
        assert cli.main([*command, *units]) == 0
    assert cli.main([*command, "--show", "m,s,kN"]) == cli.BAD_INPUT
    assert "state them, too" in capsys.readouterr().err
    assert cli.main([*command, "--units", "m,s,pound", "--show", "m,s,kN"]) == cli.BAD_INPUT
    assert "units m,s,pound cannot be converted; known are" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("density", "weight", "fitting"),
    [
        (2500, 24525, {"m,s,N"}),
        (2.5, 24.525, {"m,s,kN"}),
        (2.5e-9, 24.525e-6, {"mm,s,N"}),
        (2.5e-9, 0, {"mm,s,N"}),
        (2.5e6, 24525, {"m,s,N"}),  # a scaled mass: the weight is possible
        (1, 1, {"m,s,kN"}),
        (1e-3, 1e-3, set()),
    ],
)
def test_units_are_refused_when_no_solid_fits(tmp_path, density, weight, fitting):
    results = rockdda.open(write_results(tmp_path / "a.h5", density, weight))
    for units in ("m,s,N", "m,s,kN", "mm,s,N"):
        if units in fitting:
            check_units(results, units)
        else:
            with pytest.raises(rockdda.InputError, match="cannot be in these units"):
                check_units(results, units)
    check_units(results, "furlong,fortnight,N")  # not known: they are labels


def test_all_numbers_are_converted(flat_arch, tmp_path):
    """Each field and column by the unit that its label names, from m, s, N to mm, ms, kN."""
    plain = rockdda.open(flat_arch)
    shown = in_units(plain, "m,s,N", "mm,ms,kN")
    factor = {
        "length": 1e3,
        "time": 1e3,
        "force": 1e-3,
        "speed": 1.0,
        "spin": 1e-3,
        "stress": 1e-9,
        "rad": 1.0,
        "": 1.0,
    }
    for name in FIELDS:
        expected = plain.frames[-1].field(name) * factor[DIMENSIONS[name]]
        # displacements are differences of coordinates of up to 10 m: round-off of these
        np.testing.assert_allclose(shown.frames[-1].field(name), expected, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(shown.frames[-1].contacts.force, 1e-3 * plain.frames[-1].contacts.force, rtol=1e-14)
    np.testing.assert_allclose(shown.block_area, 1e6 * plain.block_area, rtol=1e-14)
    before, after = plain.history(), shown.history()
    for column in before:
        (power,) = next((t.powers for path, t in TABLES.items() if column.startswith(path.split("/")[1])), [(0, 0, 0)])
        scale = (1e3 ** power[0]) * (1e3 ** power[1]) * (1e-3 ** power[2])
        np.testing.assert_allclose(after[column], scale * before[column], rtol=1e-12, err_msg=column)
    assert shown.frame_at(1e9).time == pytest.approx(1e3 * plain.frames[-1].time, rel=1e-14)
    np.testing.assert_array_equal(shown.block_rows("stress", 1)[-1], shown.frames[-1].stress[1])


def test_every_dataset_has_a_unit_or_none(flat_arch):
    """A dataset that the program adds must be given its unit here."""
    without = (
        "rotation",
        "edge_joint",
        "offset",
        "material",
        "step",
        "iterations",
        "attempts",
        "contacts",
        "state",
        "blocks",
        "unbalanced",
        "stage",
        "stage_names",
        "relaxation",
        "time_error",
        "active",
        "contact_strength",
    )
    for path in sorted(rockdda.open(flat_arch).keys()):
        has_powers = path in TABLES and any(TABLES[path].powers)
        assert has_powers or path.startswith("input/") or path.endswith(without), path


def test_films_and_views_convert_too(flat_arch, tmp_path, capsys):
    film = tmp_path / "a.html"
    source = shutil.copy(flat_arch, tmp_path / "b.h5")
    assert cli.main(["animate", str(source), "-o", str(film), "--units", "m,s,N", "--show", "mm,s,kN"]) == 0
    assert " [mm]" in film.read_text()
