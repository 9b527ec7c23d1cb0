# SPDX-License-Identifier: MIT
"""Options of a model: what Python refuses, and what it takes from the table of the compiled part."""

import json
from pathlib import Path

import jsonschema
import pytest
import rockdda
from rockdda.namelist import parse_groups
from rockdda.options import check_options, names_that_add_up, options_schema

ROOT = Path(__file__).resolve().parents[2]

GOOD = {
    "run": {"t_end": 2.0, "strict": True},
    "contact": {"preset": "dda_windows"},
    "load": {"harmonic": [1, 0, 2.0, 0, 0]},
    "stage": [{"until_step": 3, "release": 1}, {"k01": 0.0}],
}
BAD = [
    ({"timee": {"dt_max": 1.0}}, "options['timee']: unknown group; did you mean 'time'?"),
    ({"time": {"dt_mx": 1.0}}, "options['time']['dt_mx']: unknown name; did you mean 'dt_max'?"),
    ({"time": {"dt_max": 0}}, "options['time']['dt_max']: must be greater than 0, found 0"),
    ({"time": {"max_open_close": 2.5}}, "options['time']['max_open_close']: expected a whole number, found 2.5"),
    ({"time": {"rotation": "exakt"}}, "options['time']['rotation']: expected one of 'exact', 'linear', found 'exakt'"),
    ({"output": {"frames": 1}}, "options['output']['frames']: expected True or False, found 1"),
    ({"line_load": [{"ends": [0, 0, 1]}]}, "options['line_load']['ends']: expected 4 numbers, found [0, 0, 1]"),
    ({"load": {"harmonic": [1, 2]}}, "options['load']['harmonic']: expected a multiple of 5 numbers, found [1, 2]"),
    ({"stage": [{"release": [1, 0]}]}, "options['stage']['release']: must be at least 1, found [1, 0]"),
]


def test_the_schema_is_that_of_the_documentation():
    assert options_schema() == json.loads((ROOT / "docs/options.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(options_schema())


def test_good_options_pass():
    check_options(GOOD)
    jsonschema.validate(GOOD, options_schema())


@pytest.mark.parametrize(("options", "message"), BAD)
def test_bad_options_are_refused_before_anything_is_written(options, message, tmp_path):
    model = rockdda.Model("block", options=options)
    with pytest.raises(rockdda.InputError) as caught:
        model.write(tmp_path / "new")
    assert message in str(caught.value)
    assert not (tmp_path / "new").exists()


def test_terms_given_several_times_add_up():
    assert "harmonic" in names_that_add_up()
    text = "&load harmonic = 1,0,2,0,0 harmonic = 5*0.5 / &run steps = 1 steps = 2 /"
    assert parse_groups(text, names_that_add_up()) == {
        "load": {"harmonic": [1, 0, 2, 0, 0, 0.5, 0.5, 0.5, 0.5, 0.5]},
        "run": {"steps": 2},
    }
