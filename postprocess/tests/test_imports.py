# SPDX-License-Identifier: MIT
"""Modules of the package import in one direction."""

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
import rockdda
from places import INPUTS
from rockdda.analysis.compare import compare
from rockdda.convert import convert
from rockdda.export import to_csv
from rockdda.options import _rows, _schema_text, names_that_add_up, options_schema
from rockdda.plot import blocks, input_plot
from synthetic import write_wall

PACKAGE = Path(rockdda.__file__).parent
PAGE = Path(__file__).resolve().parents[2] / "docs/python.md"

#: Modules and sub-packages, each of which imports only what stands before it. docs/python.md shows the same order.
ORDER = (
    "errors", "arrays", "version", "outputs", "writing", "program", "text", "notebook", "interrupts",
    "namelist", "materials", "native", "options", "groups", "storage", "fields", "columns", "rings", "start",
    "frames", "joints", "stages", "results", "units", "deck", "labelled", "cutting", "simulation",
    "model",
    "critical", "networks", "records", "plot", "film", "convert", "export", "analysis", "study", "certainty", "report",
    "cli", "__init__", "__main__",
)  # fmt: skip


def module_of(file: Path) -> tuple[str, ...]:
    """Parts of the module's name behind "rockdda"; a package ends in "__init__"."""
    return file.relative_to(PACKAGE).with_suffix("").parts


MODULES = {module_of(file): file for file in PACKAGE.rglob("*.py")}


def target_of(base: tuple[str, ...], name: str) -> tuple[str, ...]:
    """The module behind `from base import name`: a submodule, or base itself."""
    for parts in ((*base, name), (*base, name, "__init__"), base, (*base, "__init__")):
        if parts in MODULES:
            return parts
    assert base == (), f"there is no module {'.'.join(base)}"
    return ("__init__",)


def imports_of(source: str, module: tuple[str, ...]) -> set[tuple[str, ...]]:
    """Modules of the package that a module imports: at its top, in its functions, and for type checking."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                package, *parts = alias.name.split(".")
                if package == "rockdda":
                    found.add(target_of(tuple(parts[:-1]), parts[-1]) if parts else ("__init__",))
        elif isinstance(node, ast.ImportFrom):
            parts = tuple(node.module.split(".")) if node.module else ()
            if node.level:
                base = (*module[: -node.level], *parts)
            elif parts[0] == "rockdda":
                base = parts[1:]
            else:
                continue
            found |= {target_of(base, alias.name) for alias in node.names if alias.name != "_rockdda"}
    return found


GRAPH = {module: imports_of(file.read_text(encoding="utf-8"), module) for module, file in MODULES.items()}


def upward(graph: dict) -> list[str]:
    """Imports against the order."""
    return [
        f"{'.'.join(module)} imports {'.'.join(target)}"
        for module, targets in graph.items()
        for target in targets
        if target[0] != module[0] and ORDER.index(target[0]) > ORDER.index(module[0])
    ]


def test_every_module_has_a_place_in_the_order():
    assert {module[0] for module in MODULES} == set(ORDER)
    assert len(GRAPH) > 80
    assert sum(map(len, GRAPH.values())) > 250  # the imports are found


def test_no_module_imports_upward():
    assert upward(GRAPH) == []


def test_no_circle_of_imports():
    try:
        TopologicalSorter(GRAPH).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(".".join(module) for module in error.args[1]))


def test_upward_imports_and_circles_are_found():
    """Also in functions, under TYPE_CHECKING, and with the full name."""
    for source in (
        "from .plot import blocks",
        "def f():\n    from . import plot",
        "if TYPE_CHECKING:\n    from .plot.style import RC",
        "import rockdda.plot",
        "from rockdda.plot import style",
    ):
        changed = {**GRAPH, ("frames",): imports_of(source, ("frames",))}
        assert len(upward(changed)) == 1, source
        with pytest.raises(CycleError):
            TopologicalSorter(changed).prepare()


def test_the_page_shows_the_order():
    (line,) = (line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("`errors` →"))
    assert [name.strip(" `") for name in line.split("→")] == [name for name in ORDER if not name.startswith("_")]


def test_unknown_attributes_are_errors():
    with pytest.raises(AttributeError, match="has no attribute 'convert_dwg'"):
        rockdda.convert_dwg  # noqa: B018


def _model():
    model = rockdda.Model("box")
    model.add_polygon([(0, 0), (1, 0), (0, 1)])
    model.add_block_material(density=1, gravity=1, youngs_modulus=1, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=10)
    return model


def _with_a_fixed_line():
    model = _model()
    model.add_fixed((0.1, 0.1), (0.2, 0.2))
    return model


def _with_options():
    model = _model()
    model.options["time"] = {"dt_max": 1.0}
    return model


#: What the page says to need the compiled part.
NEEDS_COMPILED = {
    "run": lambda folder: rockdda.run(INPUTS / "flat_arch"),
    "Simulation": lambda folder: rockdda.Simulation(INPUTS / "flat_arch"),
    "cut": lambda folder: rockdda.cut([[0, 0, 1, 0]]),
    "lines": lambda folder: rockdda.lines({"boundary": {"window": [0, 0, 1, 1]}}, seed=1),
    "Model.read": lambda folder: rockdda.Model.read(INPUTS / "flat_arch"),
    "Model.add_group": lambda folder: _model().add_region("all", box=(0, 0, 1, 1)),
    "Model.write` with\noptions": lambda folder: _with_options().write(folder),
    "or with fixed lines": lambda folder: _with_a_fixed_line().write(folder),
    "options.options_schema": lambda folder: options_schema(),
    "plot.input_plot": lambda folder: input_plot(INPUTS / "flat_arch/flat_arch.dc"),
}


@pytest.fixture
def without_compiled(monkeypatch):
    monkeypatch.setitem(sys.modules, "rockdda._rockdda", None)
    monkeypatch.delattr(rockdda, "_rockdda", raising=False)
    for function in (_schema_text, _rows, names_that_add_up):
        function.cache_clear()
    yield
    for function in (_schema_text, _rows, names_that_add_up):
        function.cache_clear()


@pytest.mark.parametrize("name", NEEDS_COMPILED)
def test_what_needs_the_compiled_part_says_so(without_compiled, tmp_path, name):
    said = PAGE.read_text().split("These need it")[1]
    assert name in said
    with pytest.raises(ImportError, match="the compiled part of rockdda is missing"):
        NEEDS_COMPILED[name](tmp_path / "model")


def test_results_need_no_compiled_part(without_compiled, tmp_path):
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2))
    to_csv(results, tmp_path / "wall.csv", "blocks")
    results.animate(tmp_path / "wall.html")
    blocks(results)
    assert compare(results, results).same
    (tmp_path / "a.geojson").write_text('{"type":"LineString","coordinates":[[0,0],[1,1]]}')
    convert(tmp_path / "a.geojson", tmp_path / "a")
    assert [path.name for path in _model().write(tmp_path / "model")] == ["box.dc", "box.df"]


def test_the_import_is_quick():
    """Neither NumPy nor h5py are loaded before they are used; 0.25 s of processor time are far from it."""
    code = (
        "import sys, time; start = time.process_time(); import rockdda; used = time.process_time() - start; "
        "heavy = {'numpy', 'h5py', 'matplotlib', 'pandas'} & set(sys.modules); print(used, *heavy); "
        "rockdda.Results; assert rockdda.results.Results is rockdda.Results; assert 'h5py' in sys.modules"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={"PYTHONPATH": str(PACKAGE.parent)},
        capture_output=True,
        text=True,
        check=True,
    )
    used, *heavy = done.stdout.split()
    assert heavy == []
    assert float(used) <= 0.25


def test_help_of_the_command_loads_no_numbers():
    """NumPy, h5py and Matplotlib take longer to load than the help to print."""
    code = (
        "import sys\nfrom rockdda.cli import app\n"
        "print(*sorted({'numpy', 'h5py', 'matplotlib', 'pandas'} & set(sys.modules)))"
    )
    command, environment = [sys.executable, "-c", code], {"PYTHONPATH": str(PACKAGE.parent)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_public_names_are_there():
    assert set(rockdda.__all__) == set(rockdda._HOMES)
    assert all(getattr(rockdda, name) is not None for name in rockdda.__all__)
    assert set(rockdda.__all__) <= set(dir(rockdda))
    assert all(getattr(rockdda, name).__name__ == f"rockdda.{name}" for name in rockdda._MODULES)
