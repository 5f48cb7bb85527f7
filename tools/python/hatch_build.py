"""Puts the programs into the wheel, with its licences and those of what they are made of."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGES = {"percuss": "percuss", "percuss-reader": "percuss-read"}
"""Packages of the workspace and their programs."""
LICENCES = ["LICENSE-MIT", "LICENSE-APACHE"]
NOTICES = "tools/release/notices"
"""Program of the workspace that writes the licences of others."""
FOLDER = "PERCUSS_PROGRAMS"
"""Variable of the environment with the folder of programs that are built already."""


class Programs(BuildHookInterface):  # type: ignore[type-arg]
    """Builds the programs, or takes those that are built already."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        workspace = Path(self.root).parents[1]
        if not (workspace / NOTICES).exists():
            raise SystemExit("percuss: the wheel is built in a clone or from its repository, not of a source distribution.")
        given = os.environ.get(FOLDER)
        folder = Path(given) if given else build(workspace)
        programs = [folder / name for name in PACKAGES.values()]
        build_data["shared_scripts"] = {str(program): program.name for program in programs}
        licences = f"percuss-{self.metadata.version}.dist-info/licenses"
        build_data["force_include"] = {str(workspace / name): f"{licences}/{name}" for name in LICENCES}
        build_data["force_include"][str(self.notices(workspace))] = "percuss/THIRD-PARTY.txt"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform(programs)}"

    def notices(self, workspace: Path) -> Path:
        """Writes the licences of all packages in the programs; they go with the build."""
        self.work = tempfile.TemporaryDirectory()
        path = Path(self.work.name) / "notices"
        subprocess.run([sys.executable, workspace / NOTICES, "-o", path], check=True, stdout=subprocess.DEVNULL)
        return path

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        self.work.cleanup()


def build(workspace: Path) -> Path:
    """Builds the programs with cargo; returns their folder."""
    cargo = shutil.which("cargo")
    if cargo is None:
        raise SystemExit(
            "percuss: the wheel contains two programs in Rust. Build it where Rust is installed (https://rustup.rs), or set "
            f"{FOLDER} to a folder with both programs."
        )
    packages = [f"--package={package}" for package in PACKAGES]
    target = os.environ.get("CARGO_TARGET_DIR", workspace / "target")
    subprocess.run([cargo, "build", "--release", "--locked", "--bins", *packages], cwd=workspace, check=True)
    return workspace / target / "release"


def platform(programs: list[Path]) -> str:
    """Where the programs run: on Linux the oldest C library with all versions of symbols that they ask for."""
    name = re.sub(r"\W", "_", sysconfig.get_platform())
    versions = [int(minor) for program in programs for minor in re.findall(rb"\0GLIBC_2\.(\d+)", program.read_bytes())]
    return name.replace("linux", f"manylinux_2_{max(versions)}") if versions else name
