"""What Python runs is what the programs of the installed wheel run."""

from __future__ import annotations

import io
import json
import os
import signal
import sys
import sysconfig
import threading
import time
import zlib
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any, assert_type

import numpy as np
import pandas
import percuss
import pytest
import xarray
from conftest import BALL, Programs

SMALL: dict[str, Any] = {"mesh.cells": 20, "record": {"frames": 0, "probes": [0.0, np.float64(0.5)]}}
LONG: dict[str, Any] = {"mesh.cells": np.int64(400), "run.end_time": 60}
PUNCH: dict[str, Any] = {
    "title": 'A "punch"',
    "model": "rakhmatulin",
    "target": {"thickness": 1.0, "shear_wave_speed": 0.5},
    "indenter": {"shape": "flat", "radius": 1.0, "mass": np.inf},
    "mesh": {"cells": 20},
    "run": {"end_time": 1},
    "record": {"lines": [{"r": 0}, {"z": 0.5}], "frames": 0},
}


def test_the_wheel_is_installed(program: Programs) -> None:
    """What is tested is no source tree, and package and programs are of one version."""
    assert Path(percuss.__file__).is_relative_to(sysconfig.get_path("purelib"))
    for name in ["percuss", "percuss-read"]:
        assert program(name, "--version").split()[1] == metadata.version("percuss")


def test_run_by_name(program: Programs, tmp_path: Path) -> None:
    run = percuss.run("fig5", **SMALL)
    program("percuss", "run", "fig5", "--set=mesh.cells=20", "--set=record.frames=0", "--set=record.probes=[0,0.5]", "-q", cwd=tmp_path)
    program("percuss-read", "diff", run.path, tmp_path / "fig5.mcap")
    assert run.case["mesh"]["cells"] == 20 and list(run.probes.r) == [0.0, 0.5]
    advised = [str(text) for text in run.events["text"] if str(text).startswith("warning: ")]
    assert len(advised) > 1 and [f"warning: {text}" for text in run.warnings] == advised
    folder = run.path.parent
    assert folder.exists()
    del run
    assert not folder.exists()


def test_run_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "ball.toml").write_text(BALL)
    output = tmp_path / "out.mcap"
    run = percuss.run(tmp_path / "ball.toml", output=output, tables="xarray", impact={"velocity": "4 m/s"})
    assert_type(run.drag, xarray.Dataset)
    assert run.path == output and run.case["impact"]["velocity"] == "4.0 m/s"
    assert run.drag.force.attrs["units"] == "N" and run.drag.time.attrs["units"] == "s"
    assert float(run.drag.force.max()) == run.summary["peak_force"]
    with pytest.raises(percuss.RunError, match="exists"):
        percuss.run(tmp_path / "ball.toml", output=output)
    percuss.run(str(tmp_path / "ball.toml"), output=output, overwrite=True)
    assert percuss.open(output).case["impact"]["velocity"] == "5.0 m/s"


def test_run_of_dictionaries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = percuss.run(PUNCH)
    assert run.metadata["percuss.run"]["title"] == 'A "punch"'
    assert run.case["indenter"]["mass"] == np.inf and [*run.case["record"]["lines"]] == [{"r": 0.0}, {"z": 0.5}]
    # a path counts from the current folder
    (tmp_path / "nose.csv").write_text("r, f\n0, 0\n0.5, 0.02\n1.0, 0.3\n")
    monkeypatch.chdir(tmp_path)
    known = percuss.check(PUNCH | {"indenter": {"shape": "profile", "file": Path("nose.csv")}})
    assert known["case"]["indenter"]["points"][-1] == [1.0, 0.3]
    with pytest.raises(TypeError, match="None has no place in a case"):
        percuss.check(PUNCH, mesh={"cells": None})


def test_check(program: Programs) -> None:
    known = percuss.check("fig5", mesh={"cells": 30})
    assert known["case"]["mesh"]["cells"] == 30 and known["estimate"]["memory_bytes"] > 0 and known["warnings"]


def test_errors_have_place_and_cause(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(BALL.replace("cells = 20", "sells = 20"))
    calls: list[Callable[..., object]] = [percuss.check, percuss.run, percuss.exact]
    for call in calls:
        with pytest.raises(percuss.CaseError, match="unknown key `mesh.sells`") as raised:
            call(tmp_path / "bad.toml", **{"run.end_time": "-1 us"})
        key, value = raised.value.problems
        assert key.place == percuss.Place(str(tmp_path / "bad.toml"), 1 + BALL[: BALL.find("cells")].count("\n"), 1)
        assert key.help is not None and "did you mean `mesh.cells`" in key.help
        assert "`run.end_time`" in value.message and value.place is not None and value.place.text == "--set"
        assert isinstance(raised.value, percuss.Error)
    with pytest.raises(percuss.CaseError, match="did you mean `fig5`") as raised:
        percuss.run("fig55")
    assert raised.value.problems[0].place is None
    with pytest.raises(percuss.CaseError, match="no closed form covers this case"):
        percuss.exact("laminate-glass")
    with pytest.raises(percuss.CaseError, match=r"`run.bounces` = 3 .* set it to 1"):
        percuss.run("ball", run={"bounces": 3})
    with pytest.raises(ValueError, match="is none of pandas"):
        percuss.run("fig5", tables="excel")  # type: ignore[call-overload]
    with pytest.raises(percuss.RunError, match="/none/"):
        percuss.run("fig5", output="/none/fig5.mcap", **SMALL)


def test_exact(program: Programs) -> None:
    form = percuss.exact("fig2-prescribed", **SMALL)
    assert form.metadata["percuss.run"]["source"] != "simulation"
    run = percuss.run("fig2-prescribed", **SMALL)
    assert abs(form.drag["force"] - run.drag["force"]).max() < 0.1 * run.drag["force"].max()


def test_sweep(program: Programs, tmp_path: Path) -> None:
    vary = {"indenter.mass": [1, 2.0], "target.shear_wave_speed": "0.3:0.5:2"}
    done = percuss.sweep("fig5", vary, output=tmp_path / "s", mesh={"cells": 20}, record={"frames": 0})
    table = done.summary
    assert_type(table, pandas.DataFrame)
    assert list(table["case"]) == [1, 2, 3, 4] and list(table["indenter.mass"]) == [1, 1, 2, 2]
    assert table.attrs["units"]["peak_force"] == done.summary_units["peak_force"] == "πR²γc_p²"
    assert list(table["status"]) == ["completed"] * 4 and table["yield_ratio"].isna().all()
    assert "mass" in table["warnings"][0].split(";")
    for number in [1, 4]:
        run = done.recording(number)
        assert run.summary["peak_force"] == table["peak_force"][number - 1]
        assert run.case["indenter"]["mass"] == table["indenter.mass"][number - 1]
    # what is done is not computed again
    journal = (tmp_path / "s" / "manifest.jsonl").read_text()
    again = percuss.sweep("fig5", vary, output=tmp_path / "s", tables="xarray", mesh={"cells": 20}, record={"frames": 0})
    assert (tmp_path / "s" / "manifest.jsonl").read_text() == journal
    assert again.summary.sizes == {"case": 4} and again.summary.peak_force.attrs["units"] == "πR²γc_p²"
    with pytest.raises(percuss.CaseError, match=r"none has been run(.|\n)*`indenter.mass` = -1"):
        percuss.sweep("fig5", {"indenter.mass": [1, -1]}, **SMALL)


def test_failed_cases_stand_in_the_summary(tmp_path: Path) -> None:
    vary = {"indenter.mass": [1, 2]}
    percuss.sweep("fig5", vary, output=tmp_path / "s", keep="none", **SMALL)
    journal = tmp_path / "s" / "manifest.jsonl"
    first, second = sorted(journal.read_text().splitlines(), key=lambda line: int(json.loads(line)["case"]))
    entry = json.loads(second) | {"state": "failed", "message": "it burst", "measures": {}}
    del entry["crc32"]
    text = json.dumps(entry, separators=(",", ":"))[:-1]
    journal.write_text(f'{first}\n{text},"crc32":"{zlib.crc32(text.encode()):08x}"}}\n')
    for _ in range(2):
        table = percuss.sweep("fig5", vary, output=tmp_path / "s", keep="none", **SMALL).summary
        assert list(table["status"]) == ["completed", "failed"] and np.isnan(table["peak_force"][1])
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(percuss.RunError):
        percuss.sweep("fig5", vary, output=tmp_path / "file" / "s", **SMALL)


def test_sweeps_of_texts_and_samples() -> None:
    small: dict[str, Any] = {"title": "balls", "mesh.cells": 20, "record.frames": 0, "run.end_time": "20 us"}
    vary = {"target.material": ["pmma", "glass"], "indenter.mass": ["1 g", "2 g"]}
    done = percuss.sweep("ball", vary, zip=True, keep="worst:peak_force", **small)
    assert list(done.summary["target.material"]) == ["pmma", "glass"] and list(done.summary["indenter.mass"]) == [0.001, 0.002]
    assert done.recording(2).case["title"] == "balls"
    with pytest.raises(percuss.RecordingError, match="no recording of case 1"):
        done.recording(1)
    run = percuss.sweep("fig5", {"indenter.mass": "1:10"}, lhs=2, seed=7, **SMALL).recording(1)
    assert run.path.exists() and run.drag is not None


def test_interruption(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interruption of Python ends the program, which leaves a part to go on with."""
    output = tmp_path / "long.mcap"
    part = output.with_name("long.mcap.part")
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    # jobs in the background begin with it ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)

    def interrupt() -> None:
        while "step" not in shown.getvalue():
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        percuss.run("fig5", output=output, progress=True, **LONG)
    assert shown.getvalue().startswith("\r") and "steps/s, ETA" in shown.getvalue()
    assert percuss.open(part).metadata["percuss.status"]["status"] == "interrupted" and not output.exists()
    with pytest.raises(percuss.RunError, match="long.mcap.part"):
        percuss.run("fig5", output=output, **LONG)


def test_resumption(program: Programs, tmp_path: Path) -> None:
    output = tmp_path / "fig5.mcap"
    first = percuss.run("fig5", output=output, resume=True, **SMALL)
    assert percuss.run("fig5", output=output, resume=True, **SMALL).summary == first.summary


def test_a_missing_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata, "files", lambda name: None)
    monkeypatch.setenv("PATH", "")
    percuss._program.find.cache_clear()
    with pytest.raises(percuss.Error, match="`percuss` is neither in the installed package nor on PATH"):
        percuss.check("fig5")
    percuss._program.find.cache_clear()
