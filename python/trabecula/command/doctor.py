"""What an installation is and has: for reports of errors, and to see what is missing."""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
from importlib import metadata
from typing import Any

from .. import _core
from ..base.machine import free_disk

__all__ = ["state", "words"]


def state() -> dict[str, Any]:
    """Versions, processors, free memory and disk (bytes, None where unknown), where the command is found, and of each extra
    its packages with their versions (None where missing).
    """
    return {
        "version": _core.__version__,
        "core": _core.__file__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "processors": os.cpu_count(),
        "threads": os.environ.get("RAYON_NUM_THREADS"),
        "free_memory": _core.free_memory(),
        "free_disk": free_disk(os.getcwd()),
        "command": shutil.which("trabecula") or shutil.which("trabecula", path=os.path.dirname(sys.executable)),
        "numpy": installed("numpy"),
        "extras": {name: {package: installed(package) for package in sorted(packages)} for name, packages in extras().items()},
    }


def extras() -> dict[str, set[str]]:
    """The packages of each extra, as the package's own metadata names them."""
    found: dict[str, set[str]] = {}
    for line in metadata.requires("trabecula") or []:
        package, _, condition = line.partition(";")
        name = re.search(r"extra == ['\"](\w+)['\"]", condition)
        if name and name[1] != "test":
            found.setdefault(name[1], set()).add(re.split(r"[<>=!~\s]", package, maxsplit=1)[0])
    return found


def installed(package: str) -> str | None:
    """The version of a package, None if it is missing."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def words(found: dict[str, Any]) -> list[str]:
    """The state in lines."""
    free = found["free_memory"]
    threads = f", RAYON_NUM_THREADS = {found['threads']}" if found["threads"] else ""
    memory = "unknown" if free is None else f"{free / 1e9:.1f} GB"
    lines = [
        f"trabecula  {found['version']} ({os.path.dirname(found['core'])})",
        f"python     {found['python']} ({sys.executable}), numpy {found['numpy']}",
        f"system     {found['system']}, {found['processors']} processors{threads}",
        f"free       memory {memory}, disk here {found['free_disk'] / 1e9:.1f} GB",
        f"command    {found['command'] or 'not found: the folder of scripts is not on the PATH; use python -m trabecula'}",
    ]
    for name, packages in found["extras"].items():
        missing = [package for package, version in packages.items() if version is None]
        have = ", ".join(f"{package} {version}" for package, version in packages.items() if version)
        cure = f"missing: {', '.join(missing)} (pip install 'trabecula[{name}]')" if missing else ""
        lines.append(f"extra      {name}: {'; '.join(filter(None, (have, cure)))}")
    return lines
