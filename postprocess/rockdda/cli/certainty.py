# SPDX-License-Identifier: MIT
"""The commands of `rockdda-post` that say how sure a number is: convergence, reliability."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from ..errors import InputError
from .common import NO_CONVERGENCE, Dask, Json, Quiet, Retry, Slurm, draw_into_files, runs_bar

if TYPE_CHECKING:
    from ..study import Outcome

ModelFiles = Annotated[
    list[Path],
    Argument(metavar="MODEL...", help="A labelled file, a folder, or a geometry or block file and its analysis file."),
]
Config = Annotated[Path | None, Option("-c", "--config", help="Options beside a geometry and an analysis file.")]
Folder = Annotated[
    Path | None, Option("-o", "--output", metavar="FOLDER", help="Folder of the study; default: NAME_ and the command.")
]
Jobs = Annotated[int | None, Option("--jobs", "-j", min=1, help="Runs at a time; default: one a core.")]
Search = Annotated[str | None, Option("--search", metavar="KIND", help="As of `rockdda fos`: strength, load, tilt …")]
Joints = Annotated[str | None, Option("--joints", metavar="NAMES", help="Joints whose strength is searched.")]
Loads = Annotated[str | None, Option("--loads", metavar="NAMES", help="Loads of --search load.")]
Factors = Annotated[str | None, Option("--factors", help="Partial factors, as of `rockdda fos`.")]
Stage = Annotated[str | None, Option("--stage", metavar="NAME", help="Stage after which the search begins.")]
From = Annotated[float | None, Option("--from", help="A value that stands.")]
To = Annotated[float | None, Option("--to", help="A value that fails.")]
Tolerance = Annotated[float | None, Option("--tolerance", help="Interval of a factor; default: 0.01.")]
MaxSteps = Annotated[int | None, Option("--max-steps", min=1, help="Steps of a trial.")]


@dataclass(frozen=True)
class Running:
    """How the runs of a study are started, and what is printed."""

    config: Config = None
    output: Folder = None
    jobs: Jobs = None
    slurm: Slurm = False
    dask: Dask = None
    retry: Retry = False
    quiet: Quiet = False
    as_json: Json = False

    def of_study(self) -> dict[str, Any]:
        """What `convergence` and `reliability` take of it."""
        return {name: getattr(self, name) for name in ("config", "output", "jobs", "dask", "retry")}


def search_options(
    search: Search = None, joints: Joints = None, loads: Loads = None, factors: Factors = None, stage: Stage = None,
    from_: From = None, to: To = None, tolerance: Tolerance = None, max_steps: MaxSteps = None,
) -> dict[str, Any]:  # fmt: skip
    """Options of a search by their names in Python."""
    return dict(locals())


def with_shared(command: Callable[..., None]) -> Callable[..., None]:
    """A command with the options of a search and of running after its own; it gets them as `options` and `running`."""

    def parameters(function: Callable[..., Any]) -> list[Parameter]:
        found = signature(function, eval_str=True).parameters.values()
        return [one.replace(kind=Parameter.KEYWORD_ONLY) for one in found if one.name not in ("options", "running")]

    search, running = parameters(search_options), parameters(Running)

    def run(**given: Any) -> None:
        options = search_options(**{one.name: given.pop(one.name) for one in search})
        how = Running(**{one.name: given.pop(one.name) for one in running})
        command(**given, options=options, running=how)

    run.__doc__ = command.__doc__
    run.__signature__ = Signature([*parameters(command), *search, *running])  # type: ignore[attr-defined]
    return run


def convergence_command(
    model: ModelFiles,
    quantity: Annotated[
        list[str] | None,
        Option(
            metavar="NAME",
            help="A number to judge: 'point 1 y', 'factor', 'max(history/energy[0])'; may be repeated. Default: all "
            "measured points at the end of every stage.",
        ),
    ] = None,
    fos: Annotated[bool, Option("--fos", help="Judge the critical factor, too, with the options below.")] = False,
    limit: Annotated[str, Option(help="Share of a number by which it may change: 0.05 or 5%.")] = "0.05",
    *,
    options: dict[str, Any],
    running: Running,
) -> None:
    """Does a number depend on numbers of the method, and how far on the stiffness of the joints?

    The model runs as it is, with half and a quarter of the time step, half the corner radius, half the size of cells
    (where there are some), another linear solver, and joints twice and half as stiff. Each number is judged in words:
    what is a number of the method, and must not matter, and what is a property, and is to be measured. The exit code is
    3 when a change exceeds --limit or a run has failed. Runs that are done are not run again.

    Examples:

        rockdda-post convergence slope.nml

        rockdda-post convergence slope.nml --fos --joints bedding --jobs 4

        rockdda-post convergence tunnel.dc tunnel.df --quantity 'point 1 y' --limit 2%

        rockdda-post convergence slope.nml --slurm && sbatch slope_convergence/model/runs/job-array.sh"""
    draw_into_files()
    from ..certainty.convergence_study import convergence, prepare_convergence
    from ..certainty.running import write_arrays
    from ..certainty.template import read_source

    share = _share(limit)
    files = _files(model)
    if running.slurm:
        with read_source(*files, running.config) as source:
            studies = prepare_convergence(source, running.output, fos, options)
            _tell_arrays(write_arrays(studies, running.retry), running)
        return
    with runs_bar(running.quiet, running.as_json, _ended) as report:
        found = convergence(
            files[0], files[1], quantities=quantity or (), fos=fos, limit=share, progress=report,
            **running.of_study(), **options,
        )  # fmt: skip
    _tell(found, NO_CONVERGENCE if found.exceeded else 0, "convergence", running)


def reliability_command(
    model: ModelFiles,
    vary: Annotated[str,
        Option(metavar="INPUTS",
            help="'NAME.OPTION = LAW(…); …': normal(mean, sd[, low, high]), lognormal(mean, sd), uniform(low, high), "
            "triangular(low, mode, high); tan(NAME.friction) is the tangent, NAME.table[4] one number of a list.",
        ),
    ] = "",
    runs: Annotated[int, Option(min=1, help="Values of a Latin hypercube.")] = 30,
    seed: Annotated[int, Option(min=0, help="Of the values, and of the first network.")] = 1,
    correlate: Annotated[str, Option(metavar="PAIRS", help="'A, B = -0.5; …'")
    ] = "",
    seeds: Annotated[int | None,
        Option(metavar="N", min=1,
            help="Draw up to N joint networks anew, from the statistics file beside the geometry.",
        ),
    ] = None,
    precision: Annotated[float, Option(help="Half of the interval at which no more networks are drawn; 0: all.")
    ] = 0.05,
    below: Annotated[float | None,
        Option(help="Factor below which the model counts as failing; default: 1."),
    ] = None,
    back_analysis: Annotated[float | None,
        Option(metavar="F", help="Find the pairs of inputs that give this factor."),
    ] = None,
    *,
    options: dict[str, Any],
    running: Running,
) -> None:  # fmt: skip
    """How likely does a model fail, where its inputs scatter or its joints are drawn anew?

    A critical factor is searched for each of some runs. A surface through the factors gives the probability of failure
    with its interval, the reliability index, the most likely failure, and which input makes the factor scatter. The
    exit code is 3 when no surface fits the factors: the probability is then the share of runs that fail. Runs that are
    done are not run again.

    Examples:

        rockdda-post reliability slope.nml --vary 'bedding.friction = normal(35, 5)'

        rockdda-post reliability slope.nml --vary 'seam.friction = normal(35, 5); seam.cohesion = lognormal(1e5, 2e4)'
        --correlate 'seam.friction, seam.cohesion = -0.5' --runs 40 --back-analysis 1.0

        rockdda-post reliability slope.nml --seeds 100 --jobs 4"""
    draw_into_files()
    from ..certainty.reliability_study import make_plan, prepare_reliability, reliability
    from ..certainty.running import write_arrays
    from ..certainty.template import read_source

    files = _files(model)
    if running.slurm:
        with read_source(*files, running.config) as source:
            plan = make_plan(source, vary, runs, seed, seeds, precision, correlate, below, back_analysis, options)
            study = prepare_reliability(source, plan, running.output, options)
            _tell_arrays(write_arrays([study], running.retry), running)
        return
    with runs_bar(running.quiet, running.as_json, _ended) as report:
        found = reliability(
            files[0], vary, files[1], runs=runs, seed=seed, seeds=seeds, precision=precision, correlate=correlate,
            below=below, back_analysis=back_analysis, progress=report, **running.of_study(), **options,
        )  # fmt: skip
    _tell(found, NO_CONVERGENCE if found.refusal else 0, "reliability", running)


def _files(model: list[Path]) -> tuple[Path, Path | None]:
    if len(model) > 2:
        raise InputError(f"expected a model, or a geometry and an analysis file, found {len(model)} files")
    return model[0], model[1] if len(model) == 2 else None


def _share(text: str) -> float:
    """0.05 or 5%."""
    try:
        value = float(text.removesuffix("%")) * (0.01 if text.endswith("%") else 1)
    except ValueError:
        value = 0.0
    if not 0 < value < 1:
        raise InputError(f"--limit: expected a share such as 0.05 or 5%, found {text!r}")
    return value


def _ended(outcome: Outcome) -> str:
    """How a run ended: a search without a factor may be an answer."""
    if outcome.status != "failed":
        return outcome.status
    return f"no answer ({outcome.message.splitlines()[0].removeprefix('rockdda: error: ')[:70]})"


def _tell_arrays(paths: list[Path], running: Running) -> None:
    if running.as_json:
        typer.echo(json.dumps({"status": "done", "exit_code": 0, "scripts": list(map(str, paths))}))
    elif not running.quiet:
        typer.echo(
            "\n".join(f"{path}: submit it with sbatch; then give this command again without --slurm" for path in paths)
        )


def _tell(found: Any, code: int, name: str, running: Running) -> None:
    """The answer; the exit code."""
    files = [str(found.folder / file) for file in (f"{name}.json", "table.csv", f"{name}.png")]
    if running.as_json:
        answer = json.loads((found.folder / f"{name}.json").read_text(encoding="utf-8"))
        typer.echo(json.dumps({"status": "done", "exit_code": code} | answer | {"files": files}, ensure_ascii=False))
    elif not running.quiet:
        typer.echo("\n".join([found.verdict, *files]))
    if code:
        raise typer.Exit(code)


COMMANDS = {"convergence": with_shared(convergence_command), "reliability": with_shared(reliability_command)}
