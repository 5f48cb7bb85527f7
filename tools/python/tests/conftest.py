"""Recordings that the tests read, made by the programs of the installed wheel."""

from __future__ import annotations

import subprocess
import sysconfig
from collections.abc import Callable
from pathlib import Path

import pytest
from former import write_former

BALL = """\
title = "Steel ball on PMMA"
model = "elastic"
[target]
thickness = "20 mm"
material = "pmma"
[indenter]
shape = "sphere"
nose_radius = "10 mm"
material = "steel"
mass = "1 g"
[impact]
velocity = "5 m/s"
[mesh]
cells = 20
[run]
end_time = "200 us"
stop = "separation"
[record]
points = [["0 mm", "10 mm"], ["5 mm", "0 mm"]]
lines = [{ r = "0 mm" }, { z = "2 mm" }]
fields = ["stress", "velocity"]
frames = 20
compression = "lz4"
"""
RUNS = {
    "flat": ["run", "fig5", "--set", "mesh.cells=30", "--set", "record.frames=40"],
    "exact": ["exact", "fig5", "--set", "mesh.cells=30"],
    "cone": [
        "run",
        "fig6a",
        "--set",
        "mesh.cells=20",
        "--set",
        "run.end_time=2",
        "--set",
        "record.frames=0",
        "--set",
        "record.probes=[]",
    ],
    "ball": ["run", "ball.toml"],
    "plane": ["run", "ball.toml", "--set", "geometry=plane", "--set", "indenter.mass=100 g/m"],
    # with all strengths that measures are of
    "laminate": [
        *["run", "laminate-glass", "--set", "record.compression=none", "--set", "target.layer.2.material=pmma"],
        *["--set", 'target.layer.2.bond_strength={ normal = "10 MPa", shear = "10 MPa" }'],
        *["--set", 'target.layer.3.bond_strength={ normal = "10 MPa", shear = "10 MPa" }'],
    ],
}
FORMER = {"flat-2.1": "flat", "ball-2.1": "ball"}

Programs = Callable[..., str]


@pytest.fixture(scope="session")
def program() -> Programs:
    """Runs one of the programs, and returns what it prints."""
    folder = Path(sysconfig.get_path("scripts"))

    def run(name: str, *arguments: object, cwd: Path | None = None) -> str:
        command = [str(folder / name), *map(str, arguments)]
        return subprocess.run(command, cwd=cwd, check=True, capture_output=True, encoding="utf-8").stdout

    return run


@pytest.fixture(scope="session")
def recordings(program: Programs, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Recordings by name, `flat` and so on; those of format 2.1 are `flat-2.1` and `ball-2.1`."""
    folder = tmp_path_factory.mktemp("recordings")
    (folder / "ball.toml").write_text(BALL)
    made = {}
    for name, arguments in RUNS.items():
        made[name] = folder / f"{name}.mcap"
        program("percuss", *arguments, "--quiet", "-o", made[name], cwd=folder)
    for name, new in FORMER.items():
        made[name] = folder / f"{name}.mcap"
        write_former(made[new], made[name])
    return made


@pytest.fixture(params=[*RUNS, *FORMER])
def recording(request: pytest.FixtureRequest, recordings: dict[str, Path]) -> Path:
    """Each of the recordings."""
    return recordings[request.param]
