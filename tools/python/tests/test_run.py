"""What Python runs is what the programs of the installed wheel run."""

from __future__ import annotations

import io
import json
import os
import pickle
import signal
import subprocess
import sys
import sysconfig
import threading
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
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
    names = [file.name for file in metadata.files("percuss") or []]
    assert {"LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY.txt"} <= {*names}


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


def test_keys_with_dots(tmp_path: Path) -> None:
    run = percuss.run("fig5", output=tmp_path / "fig5.mcap", **{"mesh.cells": 20})
    form = percuss.exact("fig5", output=tmp_path / "exact.mcap", **{"mesh.cells": 20})
    done = percuss.sweep("fig5", {"indenter.mass": [1]}, output=tmp_path / "s", **{"mesh.cells": 20})
    assert_type(run, percuss.Recording[Any])
    assert_type(form, percuss.Recording[Any])
    assert_type(done, percuss.Sweep[Any])
    for recording in [run, form, done.recording(1)]:
        assert recording.case["mesh"]["cells"] == 20


def test_recordings_move_to_other_folders_and_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run = percuss.run("fig5", output="fig5.mcap", **SMALL)
    done = percuss.sweep("fig5", {"indenter.mass": [1]}, output="s", **SMALL)
    assert run.path == tmp_path / "fig5.mcap" and done.path == tmp_path / "s"
    monkeypatch.chdir("/")
    assert len(run.drag) == run.topics["/drag"] and list(done.summary["case"]) == [1]
    copy = pickle.loads(pickle.dumps(run))
    assert copy.drag.equals(run.drag) and copy.probes.equals(run.probes)
    assert pickle.loads(pickle.dumps(done)).recording(1).path == done.recording(1).path
    with pytest.raises(percuss.Error, match="is temporary, .* give it an `output`"):
        pickle.dumps(percuss.run("fig5", **SMALL))


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
        percuss.run("fig5", tables="excel")
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
    with pytest.raises(percuss.CaseError, match="2 of 2 cases are wrong(.|\n)*did you mean `mesh.cells`") as raised:
        percuss.sweep("fig5", {"indenter.mass": [1, -1]}, mesh={"cels": 20})
    [problem] = raised.value.problems
    assert problem.message == "unknown key `mesh.cels`" and problem.place == ("--set", 1, 6)


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


ENDED = """
import percuss, signal, sys, threading
signal.signal(signal.SIGINT, signal.default_int_handler)
keys = {"output": sys.argv[1], "mesh.cells": 400, "run.end_time": 60}
if sys.argv[2] == "main":
    percuss.run("fig5", **keys)
thread = threading.Thread(target=percuss.run, args=["fig5"], kwargs=keys)
thread.start()
thread.join()
"""


@pytest.mark.parametrize(
    ("thread", "ending"), [("main", signal.SIGTERM), ("main", signal.SIGKILL), ("other", signal.SIGTERM), ("other", signal.SIGINT)]
)
def test_the_end_of_python(tmp_path: Path, thread: str, ending: signal.Signals) -> None:
    """It ends the program, which leaves a part to go on with."""
    part = tmp_path / "long.mcap.part"
    command = [sys.executable, "-c", ENDED, str(tmp_path / "long.mcap"), thread]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True) as python:
        while not (part.exists() and part.stat().st_size > 100_000):
            time.sleep(0.05)
        # Ctrl-C goes to all of its group
        (os.killpg if ending == signal.SIGINT else os.kill)(python.pid, ending)
    for _ in range(600):
        time.sleep(0.05)
        with suppress(percuss.RecordingError):
            assert percuss.open(part).metadata["percuss.status"]["status"] == "interrupted"
            return
    raise AssertionError("it goes on")


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
