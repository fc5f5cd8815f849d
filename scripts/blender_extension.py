"""Packs build/blender/trabecula-VERSION.zip, the extension with the wheels of build/dist (``make blender``)."""

import re
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "blender"
#: Blender's names of the systems, by how the names of wheels end.
SYSTEMS = {
    "manylinux.*_x86_64": "linux-x64",
    "macosx.*_arm64": "macos-arm64",
    "macosx.*_x86_64": "macos-x64",
    "win_amd64": "windows-x64",
    "win_arm64": "windows-arm64",
}


def system_of(wheel: Path) -> str | None:
    """Blender's name of the system that a wheel is for; None if Blender runs on no such system."""
    return next((name for pattern, name in SYSTEMS.items() if re.search(pattern + r"\.whl$", wheel.name)), None)


def main() -> None:
    """Writes the zip."""
    wheels = {wheel: name for wheel in sorted((ROOT / "build/dist").glob("trabecula-*.whl")) if (name := system_of(wheel))}
    if not wheels:
        sys.exit("no wheel in build/dist is for a system that Blender runs on; `make wheels` makes those of Linux")
    manifest = (FOLDER / "blender_manifest.toml").read_text(encoding="utf-8")
    version = re.search(r'^version = "(.*)"$', manifest, re.MULTILINE)[1]
    lists = {"platforms": sorted({*wheels.values()}), "wheels": [f"./wheels/{wheel.name}" for wheel in wheels]}
    lines = "".join(f"{key} = [{', '.join(map(repr, values))}]\n" for key, values in lists.items())
    out = ROOT / "build/blender" / f"trabecula-{version}.zip"
    out.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("blender_manifest.toml", manifest.replace("# `make blender` adds the wheels.\n", lines))
        packed.write(FOLDER / "__init__.py", "__init__.py")
        for wheel in wheels:
            packed.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)
    print(f"{out.relative_to(ROOT)}: for {', '.join(lists['platforms'])}")


if __name__ == "__main__":
    main()
