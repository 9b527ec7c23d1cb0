# SPDX-License-Identifier: MIT
"""Every command of the pages runs: those of blocks in a folder made for the page, one after the other as a reader
would; of commands within sentences, that the command and its options exist."""

import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

import matplotlib as mpl
import pytest
import typer
from places import EXTENSION, INPUTS, ROOT
from rockdda.analysis.pull_test import pull_curve
from rockdda.cli import main
from rockdda.cli.command import app
from synthetic import write_wall

mpl.use("Agg")

PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/notes").glob("*.md")), ROOT / "docs/gallery/README.md",
    *sorted(INPUTS.glob("*/README.md")), INPUTS / "README.md",
]  # fmt: skip
FIRST_WORDS = (
    "rockdda", "rockdda-post", "python", "python3", "pip", "cmake", "ctest", "ninja", "export", "mkdir", "sed", "bash",
    "sh", "fpm", "sbatch", "srun", "rattler-build", "conda", "sudo", "docker", "git", "cd", "source",
)  # fmt: skip
COMMAND = re.compile(rf"(?:{'|'.join(FIRST_WORDS)}) |(?:[A-Z_]+=\S* )*(?:env|\.venv|scripts|build)/\S*\w( |$)")

#: What no test can run here, and why; where another test does, its name.
ELSEWHERE = {
    "scripts/demo": "sets up the machine and builds",
    "scripts/test": "runs this test",
    "scripts/setup": "changes the machine; the pipeline begins with it",
    "scripts/build": "the pipeline runs it",
    "scripts/bench": "test_bench.py runs --quick and --compare; options are checked below",
    "scripts/campaign": "tests/campaign/test_campaign.py runs a sample of it",
    "scripts/wheels": "long: test_install.py, by .ci/long",
    "fpm build": "compiles all of the library: the workflow test.yml",
    "pip install": "long: test_install.py",
    "python3 -m venv": "long: test_install.py and, as docs/installation.md has it, scripts/try_wheel",
    "env/bin/": "long: scripts/try_wheel reads them from docs/installation.md",
    "cmake --preset": "a build of a quarter of an hour",
    "sbatch": "needs a cluster: tests/scripts/test_hpc.py with a stand-in",
    "rockdda-post validate --full": "hours; cases run one by one in test_validation*.py",
    "rockdda-post validate --report-only": "takes records of a whole validation: test_validation.py with some",
    "rockdda-post study inputs/": "hours: 300 and 106 runs; tests/models reads and cuts them",
    "rockdda-post loosening inputs/fifty_tunnels": "takes the 50 runs",
    "rockdda-post loosening tunnel.h5": "takes points above a crown: the tutorial has the same command with its tunnel",
}  # fmt: skip
#: Shorter forms of what takes long; a run that is ended by the time has exit code 4.
QUICK = (
    (r"rockdda-post validate$", "rockdda-post validate --quick --case closed-newmark --work runs"),
    (r"^(rockdda run inputs/(?!supported_tunnel).*)$", r"\1 --max-wall 0.5"),
    (r"^(rockdda run inputs/supported_tunnel.*)$", r"\1 --steps 16"),  # the lining is placed in the third stage
    (r"^(rockdda run rock\.dc.*)$", r"\1 --steps 20"),
    (r"^rockdda fos inputs/sau_mau_ping.*$", "true"),
    (r"^(rockdda run model .*|rockdda run models/.*)$", r"\1 --steps 5 --force"),
    (r"^rockdda run slope.dc slope.df .*$", "rockdda run incline.dc incline.df -o slope.h5 --steps 5 --force"),
    (r"--max-wall 82800", "--max-wall 60"),
    (r"^(rockdda-post convert .*)$", r"\1 --force"),
    (r"^(rockdda-post convergence .*)$", r"\1 --limit 99%"),  # all is as sure as that
    (r"^(rockdda-post reliability .*--search push.*)$", "true"),  # refused, as the page has it
    (r"^(rockdda-post reliability .*)$", r"\1 --runs 12"),
    (r"--seeds 60", "--seeds 10"),
    (r"\$OMP_NUM_THREADS", "1"),
    (r"\$SLURM_ARRAY_TASK_ID", "1"),
    (r" --port 8000 --no-browser$", " --port 0 --no-browser"),
)  # fmt: skip


@dataclass
class Page:
    """The commands of a page and the files that it prints, in their order."""

    path: Path
    commands: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)


def read_page(path: Path) -> Page:
    """Blocks: four blanks, or a fence without language or of a shell."""
    page = Page(path)
    language: str | None = None
    before = ""
    lines = path.read_text(encoding="utf-8").splitlines()
    for i, line in enumerate(lines):
        fence = re.match(r"```(\w*)", line)
        if fence:
            language = fence[1] if language is None else None
            continue
        if language is None:
            named = re.search(r"[Pp]ut this into `([^`]+)`", line)
            before = named[1] if named else before
            if not line.startswith("    "):
                continue
            text = line[4:]
        elif language in ("", "sh", "bash"):
            text = line
        else:
            continue
        if text.startswith("if "):  # a small script, to the end of its block
            end = next(k for k in range(i, len(lines)) if lines[k].startswith("```"))
            page.commands.append("\n".join(lines[i:end]))
            language = "script"
        elif COMMAND.match(text.removeprefix("$ ")):
            page.commands.append(text.removeprefix("$ "))
        elif before and language is None and not lines[i - 1].startswith("    ") and before not in page.files:
            end = next((k for k in range(i, len(lines)) if lines[k] and not lines[k].startswith("    ")), len(lines))
            page.files[before] = "\n".join(row[4:] for row in lines[i:end]).rstrip() + "\n"
            before = ""
    return page


READ = [page for page in map(read_page, PAGES) if page.commands]


def as_run(command: str) -> str:
    """Without comments, with what stands in brackets, in the quick form."""
    if "\n" not in command:
        command = re.sub(r"\s+#.*|\s{3,}[a-zA-Z].*", "", command)
        command = re.sub(r"(?<!\w)\[([^\]]*)\]", r"\1", command)
    for pattern, form in QUICK:
        command = re.sub(pattern, form, command)
    if find_spec("weasyprint") is None:  # without it reports are pages
        command = re.sub(r"^(rockdda-post report .*\.)pdf\b", r"\1html", command)
    return command


def prepare(page: Path, folder: Path, program: str) -> None:
    """What a reader of the page has before its first command."""
    text = page.read_text(encoding="utf-8")
    for name in sorted(set(re.findall(r"\binputs/(\w+)", text))):
        if (INPUTS / name).is_dir():
            shutil.copytree(INPUTS / name, folder / "inputs" / name)
    if page.name == "post-processing.md":
        for name in ("roof", "slope"):
            write_wall(folder / f"{name}.h5", 5, 4)
        shutil.copy(INPUTS / "tunnel/tunnel.dc", folder / "slope.dc")
        subprocess.run([program, "cut", "slope.dc", "-o", "slope.blk"], cwd=folder, check=True, capture_output=True)
        for kind, name in (("slope", "slope"), ("tunnel", "tunnel")):
            subprocess.run([program, "new", kind, name, "--force"], cwd=folder, check=True, capture_output=True)
        subprocess.run([program, "run", "tunnel.nml", "--quiet"], cwd=folder, check=True, capture_output=True)
        for names in (("dry", "wet"), ("a", "b")):
            for name in names:
                write_wall(folder / f"{name}.h5", 3, 2)
        drawings(folder)
    elif page.name == "performance.md":
        for name in ("model", "models/1"):
            shutil.copytree(INPUTS / "incline", folder / name)
    elif page.name == "hpc.md":
        shutil.copytree(INPUTS / "incline", folder / "model")
    elif page.name == "support.md":
        subprocess.run(
            [program, "run", INPUTS / "hung_block", "-o", "out.h5", "--quiet"],
            cwd=folder, check=True, capture_output=True,
        )  # fmt: skip
        moved = [0.2e-3 * k for k in range(60)]
        force = pull_curve(moved, 1.0, 200e9 * 0.25 * math.pi * 0.025**2, 1e9, 200e3)
        rows = "".join(f"{1e3 * d},{f / 1e3}\n" for d, f in zip(moved, force, strict=True))
        (folder / "lab.csv").write_text("displacement [mm], force [kN]\n" + rows)
    elif page.name == "user-guide.md":
        for suffix in ("dc", "df"):
            shutil.copy(INPUTS / f"incline/incline.{suffix}", folder)
        subprocess.run([program, "new", "slope", "slope"], cwd=folder, check=True, capture_output=True)


def drawings(folder: Path) -> None:
    """Traces, maps, drawings and a record."""
    import ezdxf

    (folder / "traces.txt").write_text("20000\t20000\t80000\t80000\n30000\t20000\t90000\t60000\n")
    rows = ([[0, 0], [10, 10]], [[0, 10], [10, 0]])
    lines = ",".join(
        f'{{"type": "Feature", "properties": {{}}, "geometry": {{"type": "LineString", "coordinates": {row}}}}}'
        for row in rows
    )
    (folder / "traces.geojson").write_text(f'{{"type": "FeatureCollection", "features": [{lines}]}}')
    area = '{"type": "Polygon", "coordinates": [[[1, 1], [9, 1], [9, 9], [1, 9], [1, 1]]]}'
    (folder / "area.geojson").write_text(
        f'{{"type": "FeatureCollection", "features": [{{"type": "Feature", "properties": {{}}, "geometry": {area}}}]}}'
    )
    wall = ezdxf.new()
    for x in (0, 1):
        wall.modelspace().add_lwpolyline([(x, 0), (x + 1, 0), (x + 1, 1), (x, 1)], close=True)
    wall.saveas(folder / "wall.dxf")
    for name, ends in (
        ("section", ((0, 0), (9000, 0), (9000, 9000), (0, 9000))),
        ("faults", ((4000, 0), (5000, 9000))),
    ):
        drawing = ezdxf.new()
        layer = "boundary" if name == "section" else "faults"
        corners = [(500000000 + x, 6800000000 + y) for x, y in ends]
        drawing.modelspace().add_lwpolyline(corners, close=name == "section", dxfattribs={"layer": layer})
        drawing.saveas(folder / f"{name}.dxf")


def view(arguments: list[str], folder: Path) -> None:
    """The page answers; Ctrl-C ends it."""
    code = f"import rockdda; rockdda.__path__.append({str(EXTENSION)!r}); from rockdda.cli import run; run()"
    command = [sys.executable, "-c", code, *arguments, "--port", "0", "--no-browser"]
    path = os.pathsep.join([str(ROOT / "postprocess"), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": path}
    ) as it:
        try:
            told = it.stdout.readline()
            address = re.search(r"http://\S+", told)[0]
            with urllib.request.urlopen(address, timeout=60) as answer:
                assert b"</html>" in answer.read()
            it.send_signal(signal.SIGINT)
            assert it.wait(timeout=60) in (0, 130)
        finally:
            it.kill()


def run(command: str, folder: Path, program: str, capsys) -> None:
    words = shlex.split(command)
    if words[0] == "rockdda-post":
        words = [one for word in words for one in (sorted(map(str, Path().glob(word))) if "*" in word else [word])]
        if words[1] == "view":
            view(words[1:], folder)
            return
        try:
            code = main(words[1:])
        except SystemExit as end:  # of --help and completion
            code = end.code
        assert not code, f"{command}: {capsys.readouterr().err}"
    else:
        path = os.pathsep.join([str(Path(program).parent), os.environ["PATH"]])
        done = subprocess.run(
            ["bash", "-c", command], cwd=folder, capture_output=True, text=True, env={**os.environ, "PATH": path}
        )
        allowed = (0, 4) if "--max-wall" in command else (0,)
        assert done.returncode in allowed, f"{command}: {done.stdout[-500:]}{done.stderr[-2000:]}"


@pytest.mark.parametrize("page", READ, ids=lambda page: str(page.path.relative_to(ROOT)))
def test_the_commands_of_the_page_run(page, program, native, tmp_path, monkeypatch, capsys):
    commands = [as_run(command) for command in page.commands]
    commands = [command for command in commands if not any(command.startswith(one) for one in ELSEWHERE)]
    if not commands:
        return
    prepare(page.path, tmp_path, program)
    for name, text in page.files.items():
        (tmp_path / name).write_text(text.replace('"--save-every", "1500"', '"--steps", "3"'), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROCKDDA_PROGRAM", str(Path(program).resolve()))
    for command in commands:
        run(command, tmp_path, program, capsys)


def test_the_pages_have_commands():
    """That the reading of the pages finds them, and which are left to other tests."""
    counts = {page.path.name: len(page.commands) for page in READ if "inputs" not in page.path.parts}
    assert len(READ) >= 30
    assert counts["post-processing.md"] >= 25 and counts["tutorial.md"] >= 15 and counts["README.md"] >= 6
    every = [as_run(command) for page in READ for command in page.commands]
    for left in ELSEWHERE:
        assert any(command.startswith(left) for command in every), left
    assert sum(any(command.startswith(left) for left in ELSEWHERE) for command in every) < 0.3 * len(every)


def in_sentences() -> list[tuple[str, str]]:
    """Commands in sentences and blocks, and where they stand."""
    found = []
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        inline = re.findall(r"`((?:rockdda|rockdda-post|scripts/[a-z_]+) [^`\n]+)`", text)
        found += [
            (str(path.relative_to(ROOT)), " ".join(command.split())) for command in [*inline, *read_page(path).commands]
        ]
    return found


def options_of(help_text: str) -> set[str]:
    return set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", help_text))


def test_commands_in_sentences_exist(program):
    """Their names and options are those that the programs have."""
    listed = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    group = typer.main.get_command(app)
    known: dict[str, set[str]] = {}
    wrong = []
    seen = 0
    for page, command in in_sentences():
        words = re.sub(r"\s+#.*|[\[\]|]", " ", command).split()
        if words[0] == "rockdda-post" and re.fullmatch(r"[a-z]+", words[1]):
            key = " ".join(words[:2])
            if words[1] not in group.commands:
                wrong.append((page, command))
                continue
            parameters = group.commands[words[1]].params
            known.setdefault(key, {one for p in parameters for one in [*p.opts, *p.secondary_opts]} | {"--help"})
        elif words[0] == "rockdda" and re.fullmatch(r"[a-z]+", words[1]):
            key = " ".join(words[:2])
            if words[1] in ("help", "completion"):
                continue
            if not re.search(rf"^\s+{words[1]}\b", listed, re.M):
                wrong.append((page, command))
                continue
            if key not in known:
                done = subprocess.run([program, words[1], "--help"], capture_output=True, text=True, check=True)
                known[key] = options_of(done.stdout) | {"--help"}
        elif words[0].startswith("scripts/"):
            key = words[0]
            script = ROOT / key
            if not script.exists():
                wrong.append((page, command))
                continue
            known.setdefault(key, options_of(script.read_text(encoding="utf-8")) | {"--help"})
            if key == "scripts/bench":
                known[key] |= options_of((ROOT / "benchmarks/suite.py").read_text(encoding="utf-8"))
        else:
            continue
        seen += 1
        given = {word.partition("=")[0] for word in words[1:] if re.match(r"--?[a-z]", word)}
        if not given <= known[key]:
            wrong.append((page, command, sorted(given - known[key])))
    assert not wrong
    assert seen > 150
