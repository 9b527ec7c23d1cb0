# SPDX-License-Identifier: MIT
"""Former names of modules: importing one gives the module that replaces it, with a DeprecationWarning."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from types import ModuleType

__all__ = ["OLD_NAMES", "install", "replacement"]

#: Modules by their name before the package had sub-packages, without the leading "rockdda.".
OLD_NAMES = {
    "animate": "film.recording",
    "animate_html": "film.page",
    "cli_common": "cli.common",
    "cli_exchange": "cli.exchange",
    "cli_study": "cli.studies",
    "cli_validate": "cli.validate",
    "compare": "analysis.compare",
    "convert_ddaml": "convert.ddaml",
    "convert_ddaml_reader": "convert.ddaml_reader",
    "convert_dxf": "convert.dxf",
    "convert_dxf_blocks": "convert.dxf_blocks",
    "convert_geojson": "convert.geojson",
    "convert_model": "convert.geometry",
    "convert_place": "convert.placing",
    "convert_regions": "convert.regions",
    "convert_report": "convert.report",
    "convert_xml": "convert.xml",
    "hdf5": "storage.file",
    "hdf5_heap": "storage.heap",
    "hdf5_structure": "storage.structure",
    "json_places": "convert.json_places",
    "loosening": "analysis.loosening",
    "plot_blocks": "plot.block_maps",
    "plot_curves": "plot.curves",
    "plot_input": "plot.input_files",
    "plot_interactive": "plot.window",
    "plot_style": "plot.style",
    "readable": "text",
    "results_check": "storage.check",
    "rock_load": "analysis.rock_load",
    "running": "simulation",
    "study_formula": "study.formula",
    "study_plot": "study.picture",
    "study_run": "study.runner",
    "view": "film.server",
    "voussoir": "analysis.voussoir",
}
PACKAGE = __name__.partition(".")[0]
_BETWEEN = (PACKAGE, "importlib", "_frozen_importlib")  # packages between the use of a name and `replacement`


def replacement(name: str) -> ModuleType:
    """The module that replaces the old one, after a warning."""
    new = f"{PACKAGE}.{OLD_NAMES[name]}"
    warnings.warn(f"{PACKAGE}.{name} is now {new}", DeprecationWarning, stacklevel=_caller_level())
    return importlib.import_module(new)


def _caller_level() -> int:
    """The `stacklevel` at which `warnings.warn`, called by `replacement`, names the code that used the old name.

    `warnings.warn` does not count the frames of the frozen import machinery.
    """
    level, frame = 2, sys._getframe(2)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in _BETWEEN:
        frozen = "importlib" in frame.f_code.co_filename and "_bootstrap" in frame.f_code.co_filename
        level, frame = level + (not frozen), frame.f_back
    return level


class _OldNames(MetaPathFinder, Loader):
    """Finds modules under their old names."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, name = fullname.partition(".")
        return spec_from_loader(fullname, self) if package == PACKAGE and name in OLD_NAMES else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = replacement(spec.name.partition(".")[2])
        self._own_specs = {**getattr(self, "_own_specs", {}), spec.name: module.__spec__}
        return module

    def exec_module(self, module: ModuleType) -> None:
        """The module has been executed under its new name; restore the specification, which the import replaced."""
        if module.__spec__ is not None:
            module.__spec__ = self._own_specs.pop(module.__spec__.name)


def install() -> None:
    """Accept the old names in import statements."""
    if not any(isinstance(finder, _OldNames) for finder in sys.meta_path):
        sys.meta_path.append(_OldNames())
