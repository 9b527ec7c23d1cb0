# SPDX-License-Identifier: MIT
"""Contact by length against closed forms, limit analysis and invariants.

    python benchmarks/contact_by_length.py                  all topics, about half an hour on one core
    python benchmarks/contact_by_length.py sliding ties     these topics only; the rows of the others are kept
    python benchmarks/contact_by_length.py --quick          the short cases of the topics; nothing is kept
    python benchmarks/contact_by_length.py --formulation vertex         with vertices on edges; nothing is kept
    python benchmarks/contact_by_length.py --table          write docs/notes/contact-by-length.md, run nothing

Needs scipy (benchmarks/requirements.txt). ROCKDDA_PROGRAM names the program, default build/bin/rockdda. Rows go to
benchmarks/results/contact_by_length.csv, the table made of them to docs/notes/contact-by-length.md.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import time
from collections.abc import Callable

from by_length import collisions, ground, laws, pushed, sliding, strength, swinging, ties
from by_length.model import ROOT, Row

RESULTS = ROOT / "benchmarks/results/contact_by_length.csv"
PAGE = ROOT / "docs/notes/contact-by-length.md"
COLUMNS = ("module", "topic", "case", "truth", "result", "met")
TOPICS: dict[str, tuple[str, Callable[[bool], list[Row]]]] = {
    "sliding": ("Sliding over joints", sliding.rows),
    "ground": ("Joint stiffness and initial stress", ground.rows),
    "swinging": ("Rocking and pendulums", swinging.rows),
    "collisions": ("Collisions", collisions.rows),
    "pushed": ("Walls, arches and stacks", pushed.rows),
    "ties": ("Intact rock in tied cells", ties.rows),
    "strength": ("Strength", strength.rows),
    "laws": ("Laws of joints", laws.rows),
}
KEPT = "## Rocking on joints that give\n"
HEAD = """# Contact by length: what it shows

Every row is a model, run with contacts by length, the default, and a truth: a closed form, limit analysis or an
invariant. The table is made by `benchmarks/contact_by_length.py`; what is not met is shown as not met.

- T20 at low g0: friction lags while the shear springs are loaded. A rigid block on the springs of its joint, the weight
  put on at once, travels 2.35 % further than on a rigid joint at g0 1e8 and 0.74 % at 1e9; the program gives that.
- T5: the truth is associated limit analysis, an upper bound. The mechanism by which the wall falls has, by equilibrium
  with Coulomb friction without dilation (linear programming), the load 0.3558, 0.881 of it. `vertex`: 0.892.
  At g0 1e9 the blocks move by the compression of their joints as well, and there is no such load.
- T20, T21 with steps: the block lies on its base at the start. One that is put 0.1 to 1 mm above it falls and bounces
  at its corners while it hardly slides; friction then lags once, by some 0.02 m/s, whatever g0 and the step: 0.7 to
  2.3 % of the distance where the base tilts it, and 0.04 % when it starts with 1 m/s.
- T23: five piles at each step, not twenty.
- All rows were computed with the program of 30 November 2026.
- Slopes: the bound is that of equilibrium with friction on all edges (linear programming); strength is the tangent of
  the bound's friction angle over that of the angle at which the slope moves.
"""


def stored() -> list[dict[str, str]]:
    """Rows of earlier runs."""
    if not RESULTS.exists():
        return []
    with RESULTS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def keep(name: str, rows: list[Row]) -> None:
    """Put the rows of a topic in place of its old ones."""
    by_topic = {topic: [row for row in stored() if row["module"] == topic] for topic in TOPICS}
    by_topic[name] = [
        {
            "module": name,
            "topic": r.topic,
            "case": r.case,
            "truth": r.truth,
            "result": r.result,
            "met": "yes" if r.met else "no",
        }
        for r in rows
    ]
    with RESULTS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for topic in by_topic.values():
            writer.writerows(topic)


def write_page() -> None:
    """The table of docs/notes/contact-by-length.md."""
    rows = stored()
    met = sum(row["met"] == "yes" for row in rows)
    text = [HEAD, f"Of {len(rows)} cases {met} are met.\n"]
    for name, (title, _) in TOPICS.items():
        own = [row for row in rows if row["module"] == name]
        if not own:
            continue
        text += [f"## {title}\n", "| | case | truth | result | met |", "|---|---|---|---|---|"]
        for row in own:
            cells = [row["topic"], row["case"], row["truth"], row["result"], "yes" if row["met"] == "yes" else "**no**"]
            text.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        text.append("")
    # sections that no run makes stand behind the tables
    kept = PAGE.read_text(encoding="utf-8").partition(KEPT)
    PAGE.write_text("\n".join([*text, "", "".join(kept[1:])]), encoding="utf-8")


def main() -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("topics", nargs="*", help=f"of {', '.join(TOPICS)}; default all")
    parser.add_argument("--quick", action="store_true", help="short cases, nothing kept")
    parser.add_argument("--table", action="store_true", help="write the table, run nothing")
    parser.add_argument("--formulation", choices=("length", "vertex"), default="length")
    arguments = parser.parse_args()
    os.environ["ROCKDDA_FORMULATION"] = arguments.formulation
    keeps = not arguments.quick and arguments.formulation == "length"
    for unknown in set(arguments.topics) - set(TOPICS):
        parser.error(f"no topic {unknown}")
    if not arguments.table:
        for name in arguments.topics or TOPICS:
            start = time.process_time(), time.monotonic()
            rows = TOPICS[name][1](arguments.quick)
            for row in rows:
                print("met " if row.met else "NOT ", row.topic, row.case, "|", row.truth, "|", row.result, flush=True)
            print(f"{name}: {time.monotonic() - start[1]:.0f} s", file=sys.stderr)
            if keeps:
                keep(name, rows)
    if keeps:
        write_page()
    return 0


if __name__ == "__main__":
    sys.exit(main())
