# SPDX-License-Identifier: MIT
"""docs/architecture.md and its figure follow from the source, and folders use only those before them."""

import importlib.util
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    [
        *ROOT.glob("docs/*.md"),
        *ROOT.glob("docs/notes/*.md"),
        *ROOT.glob("inputs/**/*.md"),
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
    ]
)


def load(name, monkeypatch):
    """A module of scripts/."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    spec = importlib.util.spec_from_file_location(name, ROOT / f"scripts/{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def architecture(monkeypatch):
    return load("draw_architecture", monkeypatch)


@pytest.fixture
def small_source(tmp_path, monkeypatch):
    """Builds a source of the files given, {path below src: text}."""
    fortran_source = load("fortran_source", monkeypatch)

    def build(files):
        for path, text in files.items():
            file = tmp_path / "src" / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return fortran_source.Source(tmp_path / "src", tmp_path)

    return build


def test_page_and_figure_are_up_to_date(architecture):
    for path, text in architecture.generated(ROOT).items():
        assert (ROOT / path).read_text(encoding="utf-8") == text, f"{path}: run scripts/draw_architecture.py"


def test_folders_use_only_those_before_them(architecture):
    source = architecture.Source(ROOT / "src", ROOT)
    assert len(source.modules) > 100
    assert architecture.order_violations(source) == []


def test_no_call_passes_a_part_of_what_the_callee_moves(monkeypatch):
    """The outline of a block with many islands read freed memory that way."""
    assert load("find_aliases", monkeypatch).find_faults(ROOT) == []


def test_procedures_use_their_arguments(monkeypatch, tmp_path, small_source):
    unused = load("find_unused_arguments", monkeypatch)
    assert list(unused.find_unused(ROOT)) == []
    module = """
module a
   type, abstract :: tool_type
   contains
      procedure :: apply
   end type tool_type
contains
   subroutine apply(self, n)
      class(tool_type), intent(in) :: self
      integer, intent(in) :: n   !! number
   end subroutine apply
   subroutine other(m, n)
      integer, intent(in) :: m, n
      call print(n)
   end subroutine other
end module a
"""
    small_source({"a.f90": module})
    assert list(unused.find_unused(tmp_path)) == ["src/a.f90: other does not use m"]


TEXT_TYPE = r"^ *type(?:, [^:\n]*)? *(?:::)? *(\w+)\n(?:(?!^ *end type).*\n)*?.*character\(len=:\), *allocatable"


def texts_in_constructors(folder: Path) -> list[str]:
    """Structure constructors with a text, of deferred length, within an array constructor: `[list, name_type(text)]`,
    but for words that are written there.

    gfortran 12 gives the copy one letter of room and writes all of them.
    """
    sources = {file: re.sub(r"&\s*\n\s*&?", "", file.read_text()) for file in sorted(folder.rglob("*.f90"))}
    types = {name for text in sources.values() for name in re.findall(TEXT_TYPE, text, re.M)}
    inside = re.compile(r"\[[^]\n!]*\b(" + "|".join(sorted(types)) + r")\((?![)'])")
    return [f"{file.name}: {found[0]}" for file, text in sources.items() for found in inside.finditer(text)]


def test_no_array_constructor_has_a_structure_with_a_text(tmp_path):
    assert texts_in_constructors(ROOT / "src") == []
    (tmp_path / "a.f90").write_text(
        "   type :: argument_type\n      character(len=:), allocatable :: text\n   end type argument_type\n"
        "      files = [files, argument_type(line%config)]\n"
    )
    assert len(texts_in_constructors(tmp_path)) == 1


def test_calls_that_pass_a_part_of_what_the_callee_moves_are_found(monkeypatch, tmp_path, small_source):
    module = """
module a
   type :: list_type
      integer, allocatable :: items(:), others(:)
   contains
      procedure :: add
   end type list_type
   type, extends(list_type) :: longer_type
      integer :: n
   end type longer_type
contains
   subroutine grow(x)
      integer, allocatable, intent(inout) :: x(:)
      integer, allocatable :: more(:)
      call move_alloc(more, x)
   end subroutine grow
   subroutine add(self, item)
      class(list_type), intent(inout) :: self
      integer, {item} :: item
      {body}
   end subroutine add
   subroutine use_it(list, k)
      type(longer_type), intent(inout) :: list
      integer, intent(in) :: k
      {call}
   end subroutine use_it
end module a
"""
    aliases = load("find_aliases", monkeypatch)
    grow = "call grow(self%items)"

    def faults(call, body=grow, item="intent(in)"):
        small_source({"cutting/a.f90": module.format(call=call, body=body, item=item)})
        return len(aliases.find_faults(tmp_path))

    assert faults("call list%add(list%items(k))") == 1
    assert faults("call add(list, item=list%items(k + 1))") == 1
    assert faults("call list%add(list%items(k))", "self%items = [self%items, item]") == 1
    assert faults("call list%add(list%items(k))", "deallocate (self%items)") == 1
    associate = "associate (x => list%items(k))\n call list%add(k)\n end associate"
    assert faults(associate) == 1
    assert faults(associate.replace("add(k)", "add(x)")) == 2
    # a copy, another array, another component, and a callee that moves nothing
    assert faults("call list%add((list%items(k)))") == 0
    assert faults("call list%add(list%items(k) + 1)") == 0
    assert faults("call list%add(list%items(k))", item="value") == 0
    assert faults("call list%add(list%others(k))") == 0
    assert faults("call list%add(list%n)") == 0
    assert faults("call list%add(list%items(k))", "self%items(1) = item") == 0


def test_a_use_of_a_later_folder_and_an_unknown_folder_are_found(architecture, small_source, monkeypatch):
    monkeypatch.setattr(architecture, "FACES", {})
    source = small_source(
        {
            "stepping/a.f90": "module a\n   use c, only : x\nend module a\n",
            "contact/b.f90": "module b\n   use, intrinsic :: iso_c_binding\n   use a, only : y\nend module b\n",
            "linear/c.f90": "module c\nend module c\n",
            "linear/own/e.f90": "module e\n   use c, only : x\nend module e\n",
            "attic/d.f90": "module d\n   use c, only : x\nend module d\n",
        }
    )
    assert len(architecture.order_violations(source)) == 2
    assert any("src/contact/b.f90 uses a of stepping" in text for text in architecture.order_violations(source))
    assert any("folder attic is not in FOLDERS" in text for text in architecture.order_violations(source))


def test_a_folder_is_entered_through_its_faces(architecture, small_source, monkeypatch):
    monkeypatch.setattr(architecture, "FACES", {"contact/find": "face", "contact/transfer": "face"})
    source = small_source(
        {
            "contact/find/face.f90": "module a\n   use b, only : x\nend module a\n",
            "contact/find/inner.f90": "module b\nend module b\n",
            "contact/transfer/inner.f90": "module c\nend module c\n",
            "contact/search.f90": "module d\n   use a\n   use b, only : x\n   use c, only : y\nend module d\n",
        }
    )
    assert sorted(architecture.order_violations(source)) == [
        "nobody enters contact/transfer through face (FACES)",
        "src/contact/search.f90 uses b, which contact/find keeps to itself (FACES)",
        "src/contact/search.f90 uses c, which contact/transfer keeps to itself (FACES)",
    ]


def test_types_and_files_that_the_page_names_exist(architecture):
    source = architecture.Source(ROOT / "src", ROOT)
    text = (ROOT / architecture.PAGE).read_text(encoding="utf-8")
    types = set(re.findall(r"`(\w+_type)\b", text))
    assert len(types) >= 5 and types <= set(source.types)
    files = set(
        re.findall(r"`(src/[\w/]+(?:\.f90)?|scripts/[\w.]+|tests/\w+|postprocess/\w+|inputs|benchmarks)`", text)
    )
    assert len(files) > 10
    assert [file for file in files if not (ROOT / file).exists()] == []


def test_every_folder_of_the_table_is_built(architecture):
    """The order of the table is that of the build, as far as both name a folder."""
    text = (ROOT / "src/CMakeLists.txt").read_text()
    built = re.search(r"foreach\(folder IN ITEMS ([^)]*)\)", text)[1].split()
    order = list(dict.fromkeys(name.split("/")[0] for name in architecture.FOLDERS if name.split("/")[0] in built))
    assert order == [name for name in built if name in order]
    assert set(built) <= set(order)


def test_calls_through_bindings_components_and_uses_are_followed(small_source):
    source = small_source(
        {
            "a.f90": """module a
   use b, only : helper => work, tool_type, other
contains
   subroutine start(self, list)
      class(outer_type), intent(inout) :: self
      real(wp), intent(inout) :: list(:)
      call self%tools(index(list, 2))%apply( &
         list(3))   ! call other()
      write (*, '(a)') 'call other()'
      list(1) = other(2)
   end subroutine start
end module a
""",
            "b.f90": """module b
   type, abstract :: tool_type
   contains
      procedure(apply_interface), deferred :: apply
   end type tool_type
   type, extends(tool_type) :: saw_type
   contains
      procedure :: apply => saw_apply
   end type saw_type
   type :: outer_type
      class(tool_type), allocatable :: tools(:)
   end type outer_type
contains
   !> Cut. With a saw.
   !>
   !> More.
   subroutine saw_apply(self)
   end subroutine saw_apply
   pure integer function other(n)
   end function other
end module b
""",
        }
    )
    start = source.modules["a"].procedures["start"]
    found = [p.name for call in start.calls for p in source.resolve(start, call)]
    assert found == ["saw_apply", "other"]
    assert source.modules["b"].procedures["saw_apply"].summary == "Cut. With a saw."


def test_the_figure_shows_the_step(architecture):
    """It names what each step does, nothing is drawn outside, and no two boxes overlap."""
    root = ET.parse(ROOT / architecture.FIGURE).getroot()
    names = {text.text for text in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"advance", "move_blocks", "src/stepping", "src/contact", "src/linear"} <= names
    width, height = float(root.get("width")), float(root.get("height"))
    boxes = [
        tuple(float(r.get(k)) for k in ("x", "y", "width", "height"))
        for r in root.iter("{http://www.w3.org/2000/svg}rect")
        if r.get("rx")
    ]
    assert 30 < len(boxes) <= 140  # more is no overview
    assert all(x >= 0 and y >= 0 and x + w <= width and y + h <= height and w > 80 for x, y, w, h in boxes)
    assert len({y for _, y, _, _ in boxes}) == len(boxes)
    labels = [
        t for t in root.iter("{http://www.w3.org/2000/svg}text") if not t.get("fill") and not t.get("font-weight")
    ]
    assert len(labels) == len(boxes)
    for label, (x, _, w, _) in zip(labels, boxes, strict=True):
        assert float(label.get("x")) + 6.7 * len(label.text) < x + w, label.text  # 6.7: a wide letter at 12 points


def test_interactions_are_listed_with_what_they_offer(architecture, small_source):
    source = small_source(
        {
            "interaction/a.f90": """module a
   type, abstract :: interaction_type
   contains
      procedure :: commit
      procedure :: prepare
   end type interaction_type
contains
   !> Change the state.
   subroutine commit(self)
   end subroutine commit
   subroutine prepare(self)
   end subroutine prepare
end module a
""",
            "interaction/b.f90": """module b
   type, extends(interaction_type) :: bolts_type
   contains
      procedure :: commit
   end type bolts_type
contains
   subroutine commit(self)
   end subroutine commit
end module b
""",
        }
    )
    found = source.implementations("interaction_type", "commit")
    assert [source.is_default(procedure) for procedure in found] == [True, False]
    rows = architecture.interaction_table(source).splitlines()
    assert "| `commit` | Change the state | bolts |" in rows
    assert "| `prepare` |  | – |" in rows
    assert (
        architecture.interaction_table(small_source({"interaction/a.f90": "module a\nend module a\n"})).count("|") == 0
    )


def headings(text):
    """Anchors of the headings of a page, as GitHub makes them."""
    body = re.sub(r"```.*?```", "", text, flags=re.S)
    for title in re.findall(r"^#+ +(.*)$", body, re.M):
        plain = re.sub(r"[^\w\- ]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title).lower())
        yield plain.replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_somewhere(page):
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"^    .*$", "", text, flags=re.M)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?:|mailto:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), target
        if anchor and file.suffix == ".md":
            assert anchor in set(headings(file.read_text(encoding="utf-8"))) | set(
                re.findall(r'<a id="([^"]+)"', file.read_text(encoding="utf-8"))
            ), target
