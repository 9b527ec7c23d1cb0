# SPDX-License-Identifier: MIT
"""Description of the machine and the build, for the figures of a measurement."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from pathlib import Path


def describe_machine(programs: Path) -> dict:
    """Processor, memory, system, compiler, version; no names of machines or people."""
    return {
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "processor": _line_of("/proc/cpuinfo", "model name"),
        "processors": os.cpu_count(),
        "caches": _caches(),
        "memory_kilobytes": _line_of("/proc/meminfo", "MemTotal").removesuffix(" kB"),
        "system": f"{platform.system()} {platform.machine()}",
        "build": _output(str(programs / "rockdda"), "--version").splitlines(),
        "revision": _output("git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"),
        "python": platform.python_version(),
    }


def load_average() -> list[float]:
    """Mean number of running processes over the last 1, 5 and 15 minutes, including this one."""
    return [round(value, 2) for value in os.getloadavg()]


def _line_of(path: str, key: str) -> str:
    try:
        for line in Path(path).read_text().splitlines():
            if line.startswith(key):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return ""


def _caches() -> list[str]:
    found = []
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        try:
            kind, level, size = ((index / name).read_text().strip() for name in ("type", "level", "size"))
        except OSError:
            continue
        found.append(f"L{level} {kind.lower()} {size}")
    return found


def _output(*command: str) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
