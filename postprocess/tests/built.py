# SPDX-License-Identifier: MIT
"""What the dynamic linker reads in built files."""

import re
import subprocess
from pathlib import Path


def linked_files(folder):
    """Programs and shared libraries below a folder."""
    found = []
    for path in sorted(Path(folder).rglob("*")):
        # what CMake tries compilers by, and programs of users that link with the library
        if {"CMakeFiles", "package"} & set(path.parts):
            continue
        if path.is_file() and not path.is_symlink() and path.suffix not in (".o", ".mod"):
            with path.open("rb") as stream:
                head = stream.read(18)
            if head[:4] == b"\x7fELF" and head[16] in (2, 3):  # executable or shared
                found.append(path)
    return found


def dynamic_sections(files):
    """{file: text of `readelf -d`}"""
    parts = {}
    for path in files:
        done = subprocess.run(["readelf", "-dW", path], capture_output=True, text=True, check=True)
        parts[path] = done.stdout
    return parts


def faults(files):
    """What lets a file load a library from the current folder or leaves its tables writable."""
    found = []
    for path, text in dynamic_sections(files).items():
        for kind, value in re.findall(r"\((RUNPATH|RPATH)\).*\[(.*)\]", text):
            for element in value.split(":"):
                if not element.startswith(("/", "$ORIGIN")):
                    found.append(f"{path}: {kind} [{value}] has the element '{element}'")
        for name in re.findall(r"\(NEEDED\).*\[(.*)\]", text):
            if "/" in name and not name.startswith("/"):
                found.append(f"{path}: needs {name} by a relative path")
        if "(NEEDED)" in text and not re.search(r"\(FLAGS\).*BIND_NOW|\(FLAGS_1\).*NOW", text):
            found.append(f"{path}: binds late")
        headers = subprocess.run(["readelf", "-lW", path], capture_output=True, text=True, check=True).stdout
        if "(NEEDED)" in text and "GNU_RELRO" not in headers:
            found.append(f"{path}: its tables can be written")
    return found
