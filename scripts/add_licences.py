# SPDX-License-Identifier: MIT
"""Packs the licences of all bundled libraries, and only one LAPACK, into a wheel; prints its path. For scripts/wheels.

The licence of a library is the file `copyright` of the Debian package that owns it; one that has none is an error.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path


def original(name: str) -> str:
    """The name of a library before auditwheel added a part of its digest: libz-1a2b3c4d.so.1 is libz.so.1."""
    return re.sub(r"-[0-9a-f]{8}(?=\.)", "", name)


def package_of(library: str) -> tuple[str, Path]:
    """The Debian package of a library, and its licence."""
    shown = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    places = re.findall(rf"^\s*{re.escape(library)} .*=> (\S+)$", shown, re.M)
    stem = library.split(".so")[0]
    places += [str(path) for path in Path("/usr/lib").glob(f"*/{stem}*.so*")]
    places += [str(path) for path in Path("/usr/lib").glob(f"*/*/{stem}*.so*")]
    for place in places:
        for form in dict.fromkeys((str(Path(place).resolve()), place, str(Path(place).resolve()).removeprefix("/usr"))):
            found = subprocess.run(["dpkg", "-S", form], capture_output=True, text=True, check=False)
            if found.returncode == 0:
                package = found.stdout.split(":")[0].split(",")[0]
                licence = Path("/usr/share/doc") / package / "copyright"
                if licence.exists():
                    return package, licence
    raise SystemExit(f"{library}: no licence found")


def lead_to_openblas(libraries: Path) -> str:
    """Replace the LAPACK beside OpenBLAS, 7 MB, by a library of its name that leads to OpenBLAS, which holds all of it
    once more; its name, or '' where there is no such pair or OpenBLAS lacks what CHOLMOD calls."""
    lapack, blas = (next(libraries.glob(form), None) for form in ("liblapack-*.so.3", "libopenblas*.so*"))
    if lapack is None or blas is None:
        return ""
    held = subprocess.run(["nm", "-D", "--defined-only", blas], capture_output=True, text=True, check=True).stdout
    called: set[str] = set()
    for user in (path for path in libraries.glob("*.so*") if path not in (lapack, blas)):
        found = subprocess.run(
            ["nm", "-D", "--undefined-only", user], capture_output=True, text=True, check=True
        ).stdout
        called |= set(re.findall(r" U ([a-z0-9]+_)$", found, re.M))
    own = subprocess.run(["nm", "-D", "--defined-only", lapack], capture_output=True, text=True, check=True).stdout
    wanted = called & set(re.findall(r" [TW] ([a-z0-9]+_)$", own, re.M))
    if not wanted or not wanted <= set(re.findall(r" [TW] ([a-z0-9]+_)$", held, re.M)):
        return ""
    with tempfile.TemporaryDirectory() as place:
        (source := Path(place) / "lapack.c").write_text("typedef int nothing;\n")
        link = [f"-Wl,-soname,{lapack.name}", "-Wl,--no-as-needed", "-Wl,-rpath,$ORIGIN"]
        subprocess.run(["cc", "-shared", "-fPIC", source, *link, blas, "-o", lapack], check=True)
    return lapack.name


def main(folder: Path, output: Path, absent: Path) -> None:
    """Add the licences to the wheel in a folder."""
    (wheel,) = folder.glob("*.whl")
    with tempfile.TemporaryDirectory() as place:
        run = [sys.executable, "-m", "wheel"]
        subprocess.run([*run, "unpack", wheel, "-d", place], check=True, capture_output=True)
        (root,) = Path(place).iterdir()
        (information,) = root.glob("*.dist-info")
        target = information / "licenses" / "bundled"
        target.mkdir(parents=True)
        rows = []
        lapack = lead_to_openblas(root / "rockdda.libs")
        for library in sorted(path.name for path in root.glob("rockdda.libs/*.so*")):
            name = original(library)
            if library == lapack:
                rows.append(f"{library}: of RockDDA (MIT); leads to OpenBLAS, in the place of {name}")
                continue
            if (absent / name).exists():
                rows.append(f"{library}: of RockDDA (MIT); procedures that fail, in the place of {name}")
                continue
            package, licence = package_of(name)
            (target / f"{package}.txt").write_bytes(licence.read_bytes())
            rows.append(f"{library}: Debian package {package}, licence in {package}.txt")
        has_cholmod = any("cholmod" in row for row in rows)
        head = "Libraries in this wheel, unchanged but for their names:\n\n"
        tail = (
            "\n\nCHOLMOD is under the GPL (version 2 or later), and so is this wheel as a whole.\n"
            if has_cholmod
            else "\n"
        )
        (target / "README.txt").write_text(head + "\n".join(rows) + tail + "\n", encoding="utf-8")
        packed = subprocess.run([*run, "pack", root, "-d", output], check=True, capture_output=True, text=True)
    print(re.findall(r"(\S+\.whl)", packed.stdout)[-1].removesuffix("..."))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))
