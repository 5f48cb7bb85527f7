"""Files that are large, damaged, cut off or of others."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas
import percuss
import pytest
from conftest import Programs
from mcap.reader import make_reader
from mcap.writer import Writer

LARGE = [
    *["mesh.cells=1000", "run.end_time=1", "record.frames=230", "record.field_every=1", "record.views=[]"],
    *['record.fields=["stress","velocity","displacement"]', "record.compression=none"],
]
ONE_FRAME = """
import percuss, sys
run = percuss.open(sys.argv[1])
frame = run.field("stress", t=0.5)
assert frame.size > 500_000 and float(frame.max()) > 1
status = open("/proc/self/status").read()
print(status.partition("VmHWM:")[2].split()[0])
"""


def test_a_frame_of_a_large_recording(program: Programs, tmp_path: Path) -> None:
    path = tmp_path / "large.mcap"
    program("percuss", "run", "fig5", *(word for key in LARGE for word in ["--set", key]), "--quiet", "-o", path)
    assert path.stat().st_size > 2_000_000_000
    peak = subprocess.run([sys.executable, "-c", ONE_FRAME, path], check=True, capture_output=True, encoding="utf-8")
    path.unlink()
    assert int(peak.stdout) * 1024 < 300_000_000


def test_only_chunks_asked_for_are_read_and_verified(recordings: dict[str, Path], tmp_path: Path) -> None:
    with open(recordings["laminate"], "rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        # the last one has nothing but the end of the log
        chunk = summary.chunk_indexes[-2]
        stream.seek(0)
        damaged = bytearray(stream.read())
    damaged[chunk.chunk_start_offset + chunk.chunk_length - 1000] ^= 1
    path = tmp_path / "damaged.mcap"
    path.write_bytes(damaged)
    run = percuss.open(path)
    whole = percuss.open(recordings["laminate"])
    assert run.field("stress", t=1e-6).equals(whole.field("stress", t=1e-6))
    reads: list[Callable[[], object]] = [lambda: run.field("stress"), lambda: run.drag, lambda: run.velocity]
    for read in reads:
        with pytest.raises(percuss.RecordingError, match="is damaged: chunk at .* crc .* recover"):
            read()
    # it is a record of the run: no message is read
    assert run.summary == whole.summary


def wrong(recording: Path, text: bytes, folder: Path) -> Path:
    """A recording with a wrong last byte of what is the last such text of it."""
    data = bytearray(recording.read_bytes())
    data[data.rindex(text) + len(text) - 1] ^= 64
    path = folder / "wrong.mcap"
    path.write_bytes(data)
    return path


def test_damaged_records(recordings: dict[str, Path], tmp_path: Path) -> None:
    whole = percuss.open(recordings["flat"])
    peak = whole.metadata["percuss.summary"]["peak_force"]
    # measured from the messages
    run = percuss.open(wrong(whole.path, peak.encode(), tmp_path))
    assert "percuss.summary" not in run.metadata and run.summary == whole.summary
    rate = b"playback_rate" + len(whole.metadata["percuss.run"]["playback_rate"]).to_bytes(4, "little")
    for text in [rate, rate + whole.metadata["percuss.run"]["playback_rate"].encode()]:
        with pytest.raises(percuss.RecordingError, match="is damaged: percuss.run: .*recover"):
            percuss.open(wrong(whole.path, text, tmp_path))
    run = percuss.open(wrong(whole.path, b"shear_wave_speed", tmp_path))
    assert run.drag.equals(whole.drag)
    with pytest.raises(percuss.RecordingError, match="is damaged: case.resolved.toml: its checksum is another one; .*recover"):
        run.case
    with pytest.raises(percuss.RecordingError, match="no sound MCAP file: its checksum is another one; .*recover"):
        percuss.open(wrong(whole.path, b"/drag", tmp_path))
    # records of format 2.1 have no checksum
    former = percuss.open(wrong(recordings["flat-2.1"], rate + b"1", tmp_path))
    with pytest.raises(percuss.RecordingError, match="is damaged: percuss.run: could not convert"):
        former.profile(t=1)


@pytest.mark.parametrize("name", ["ball", "flat", "flat-2.1"])
def test_damage_is_an_error_or_harmless(recordings: dict[str, Path], name: str, tmp_path: Path) -> None:
    reads: list[Callable[[percuss.Recording[pandas.DataFrame]], object]] = [
        lambda run: run.drag.to_numpy().tobytes(),
        lambda run: run.events.to_csv(),
        lambda run: run.profile(t=1e-5).values.tobytes(),
        lambda run: run.field("stress", t=1e-5).values.tobytes(),
        lambda run: name == "flat-2.1" or run.summary,
        lambda run: run.case,
    ]
    whole = percuss.open(recordings[name])
    data = whole.path.read_bytes()
    path = tmp_path / "damaged.mcap"
    dice = random.Random(1)
    for _ in range(100):
        damaged = bytearray(data)
        # half of them near the end, where index and metadata are
        damaged[-dice.randrange(1, dice.choice([20_000, len(data)]))] ^= 1 << dice.randrange(8)
        path.write_bytes(damaged)
        for read in reads:
            try:
                assert read(percuss.open(path)) == read(whole)
            except percuss.RecordingError:
                pass


def test_a_recording_that_is_cut_off(recordings: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap.part"
    data = recordings["flat"].read_bytes()
    for length in [len(data) - 1, len(data) // 2, 20]:
        path.write_bytes(data[:length])
        with pytest.raises(percuss.RecordingError, match="cut off or has no index; `percuss-read recover`"):
            percuss.open(path)


def test_files_of_others(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    for data in [b"", b"time,force\n0,1\n"]:
        path.write_bytes(data)
        with pytest.raises(percuss.RecordingError, match="is no sound MCAP file"):
            percuss.open(path)
    for version, error in [(None, "is no recording of percuss"), ("1.2", "has format 1.2, not 2.x")]:
        with open(path, "wb") as stream:
            writer = Writer(stream)
            writer.start()
            if version is not None:
                writer.add_metadata("percuss.run", {"format_version": version})
            writer.finish()
        with pytest.raises(percuss.RecordingError, match=f"{error}; percuss-read reads it"):
            percuss.open(path)
    with pytest.raises(FileNotFoundError):
        percuss.open(tmp_path / "none.mcap")


def test_recordings_say_what_they_are(recordings: dict[str, Path]) -> None:
    run = percuss.open(recordings["ball-2.1"])
    assert "Steel ball on PMMA" in repr(run) and "ball-2.1.mcap" in repr(run)
    assert run.metadata["percuss.run"]["format_version"] == "2.1"
    assert run.metadata["percuss.status"]["status"] in ["completed", "stopped"]
    assert run.topics["/drag"] == len(run.drag)
