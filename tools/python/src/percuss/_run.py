"""Runs, closed forms, checks and sweeps: cases in, recordings and tables out."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn, overload

import numpy as np
from numpy.typing import NDArray

from ._errors import CaseError, Error, RunError
from ._program import execute
from ._recording import Recording
from ._sweep import Sweep
from ._tables import maker
from ._toml import arguments, document, literal

if TYPE_CHECKING:
    import pandas
    import polars
    import xarray

Case = str | os.PathLike[str] | Mapping[str, Any]
"""Name of a built-in case, path of a case file, or the tables of one as dictionaries, `{"mesh": {"cells": 50}, …}`."""
Output = str | os.PathLike[str] | None


class Folder:
    """A temporary folder, there as long as this object."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="percuss-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def __reduce__(self) -> NoReturn:
        raise Error(f"{self.path} is temporary, and what is in it cannot be pickled: give it an `output`")


@overload
def run(
    case: Case,
    *,
    output: Output = None,
    overwrite: bool = False,
    resume: bool = False,
    tables: Literal["pandas"] = "pandas",
    progress: bool | None = None,
    **settings: Any,
) -> Recording[pandas.DataFrame]: ...
@overload
def run(case: Case, *, tables: Literal["xarray"], **options: Any) -> Recording[xarray.Dataset]: ...
@overload
def run(case: Case, *, tables: Literal["polars"], **options: Any) -> Recording[polars.DataFrame]: ...
@overload
def run(case: Case, *, tables: Literal["numpy"], **options: Any) -> Recording[NDArray[np.void]]: ...
@overload
def run(case: Case, **options: Any) -> Recording[Any]: ...
def run(
    case: Case,
    *,
    output: Output = None,
    overwrite: bool = False,
    resume: bool = False,
    tables: str = "pandas",
    progress: bool | None = None,
    **settings: Any,
) -> Recording[Any]:
    """Computes a case, as `percuss run` does.

        percuss.run("ball", mesh={"cells": 50})
        percuss.run("ball.toml", output="ball.mcap", **{"mesh.cells": 50})

    Args:
        case: Name of a built-in case, path of a case file, or its tables as nested dictionaries. In these a file, as that of a
            profile, is a `pathlib.Path`.
        output: The recording; None: a temporary one, there as long as the object that is returned.
        overwrite: Overwrite an existing recording, and what an interrupted run has left of one (`--force`).
        resume: Continue a run that was interrupted; a complete recording of the case is left as it is (`--resume`).
        tables: What tables are, see `open`.
        progress: Show progress on standard error; None: if that is a terminal, or Python is interactive, as in a notebook.
        settings: Keys of the case that are set, as nested dictionaries or with dots (`--set`).

    Raises:
        CaseError: The case is invalid; the problems have their places.
        RunError: The output exists or cannot be written, or the run failed.
        KeyboardInterrupt: The run was interrupted; `output` with `.part` is a recording of the steps before.
        ValueError: There are no such tables.
    """
    flags = [flag for flag, is_set in {"--force": overwrite, "--resume": resume}.items() if is_set]
    return _record("run", case, settings, output, flags, tables, progress)


@overload
def exact(
    case: Case,
    *,
    output: Output = None,
    overwrite: bool = False,
    tables: Literal["pandas"] = "pandas",
    progress: bool | None = None,
    **settings: Any,
) -> Recording[pandas.DataFrame]: ...
@overload
def exact(case: Case, *, tables: Literal["xarray"], **options: Any) -> Recording[xarray.Dataset]: ...
@overload
def exact(case: Case, *, tables: Literal["polars"], **options: Any) -> Recording[polars.DataFrame]: ...
@overload
def exact(case: Case, *, tables: Literal["numpy"], **options: Any) -> Recording[NDArray[np.void]]: ...
@overload
def exact(case: Case, **options: Any) -> Recording[Any]: ...
def exact(
    case: Case,
    *,
    output: Output = None,
    overwrite: bool = False,
    tables: str = "pandas",
    progress: bool | None = None,
    **settings: Any,
) -> Recording[Any]:
    """Records the closed form for a case, as `percuss exact` does; it is NaN where the form has no value.

    Arguments and errors as of `run`. A case without a closed form is a CaseError too.
    """
    return _record("exact", case, settings, output, ["--force"] if overwrite else [], tables, progress)


def check(case: Case, **settings: Any) -> dict[str, Any]:
    """What is known of a case before it is run, as `percuss check --json` prints it: the complete case in `case`, the mesh in
    `sizes` [R, R/c_p], `memory_bytes`, `file_bytes` and `seconds` of the run in `estimate`, `warnings` and others.

    Args:
        case: As of `run`.
        settings: As of `run`.

    Raises:
        CaseError: The case is invalid; the problems have their places.
    """
    folder = Folder()
    return _check(_given(case, settings, folder))


@overload
def sweep(
    case: Case,
    vary: Mapping[str, str | Iterable[Any]],
    *,
    output: Output = None,
    keep: str = "all",
    zip: bool = False,
    lhs: int | None = None,
    seed: int = 0,
    tables: Literal["pandas"] = "pandas",
    progress: bool | None = None,
    **settings: Any,
) -> Sweep[pandas.DataFrame]: ...
@overload
def sweep(case: Case, vary: Mapping[str, Any], *, tables: Literal["xarray"], **options: Any) -> Sweep[xarray.Dataset]: ...
@overload
def sweep(case: Case, vary: Mapping[str, Any], *, tables: Literal["polars"], **options: Any) -> Sweep[polars.DataFrame]: ...
@overload
def sweep(case: Case, vary: Mapping[str, Any], *, tables: Literal["numpy"], **options: Any) -> Sweep[NDArray[np.void]]: ...
@overload
def sweep(case: Case, vary: Mapping[str, Any], **options: Any) -> Sweep[Any]: ...
def sweep(
    case: Case,
    vary: Mapping[str, str | Iterable[Any]],
    *,
    output: Output = None,
    keep: str = "all",
    zip: bool = False,
    lhs: int | None = None,
    seed: int = 0,
    tables: str = "pandas",
    progress: bool | None = None,
    **settings: Any,
) -> Sweep[Any]:
    """Computes a case with keys that vary, on all cores, as `percuss sweep` does.

        percuss.sweep("ball", {"indenter.mass": "1 g:1 kg:7:log", "target.material": ["pmma", "steel"]}, output="masses")

    Args:
        case: As of `run`.
        vary: By key a list of values, or a range, `"from:to:count"` or `"from:to:count:log"`. All combinations are computed,
            the last key varying fastest.
        output: Folder of the sweep, where what is done is not computed again; None: a temporary one, there as long as the
            object that is returned and recordings of it.
        keep: Recordings that are kept: `all`, `none`, or `worst:MEASURE`, that of the case with the largest value of a measure.
        zip: Pair the values one by one, in place of all combinations.
        lhs: Draw so many cases from ranges without a count, as a Latin hypercube.
        seed: Seed of these.
        tables: What tables are, see `open`.
        progress: As of `run`.
        settings: Keys that are set in all cases, as of `run`.

    Raises:
        CaseError: A case or what varies is invalid; none has been run. `problems` has those of `case` and `settings`; those of
            values that vary stand in the text only.
        RunError: The folder cannot be written, or is another one's. Cases that fail are no error: the summary says which.
        KeyboardInterrupt: The sweep was interrupted; the same call with its `output` goes on.
        ValueError: There are no such tables.
    """
    make, folder = maker(tables), Folder()
    path = Path(output) if output is not None else folder.path / "sweep"
    given = [f"--output={path}", f"--keep={keep}", *(["--zip"] if zip else [])]
    given += [] if lhs is None else [f"--lhs={lhs}", f"--seed={seed}"]
    for key, values in vary.items():
        given.append(f"--vary={key}={values if isinstance(values, str) else ','.join(map(literal, values))}")
    base = _given(case, settings, folder)
    try:
        execute("sweep", *given, *base, progress=progress)
    except CaseError as error:
        text = " ".join(str(error).split())
        try:
            _check(base)
        except CaseError as every:
            # a key that is missing there may be one that varies
            error.problems = tuple(problem for problem in every.problems if problem.message in text)
        raise
    except RunError as error:
        # all have been computed, and the summary says which have failed
        if not re.match(r"\d+ of \d+ cases failed: ", str(error)):
            raise
    return Sweep(path, make, folder if output is None else None)


def _given(case: Case, settings: Mapping[str, Any], folder: Folder) -> list[str]:
    """Arguments for a case with settings; one of dictionaries is written to a file."""
    if isinstance(case, Mapping):
        tables, case = case, folder.path / "case.toml"
        case.write_text(document(tables), encoding="utf-8")
    return [*arguments(settings), "--", os.fspath(case)]


def _check(given: list[str]) -> dict[str, Any]:
    known: dict[str, Any] = json.loads(execute("check", "--json", *given))
    return known


def _record(
    verb: str,
    case: Case,
    settings: Mapping[str, Any],
    output: Output,
    flags: list[str],
    tables: str,
    progress: bool | None,
) -> Recording[Any]:
    make, folder = maker(tables), Folder()
    given = _given(case, settings, folder)
    bounces = _check(given)["case"]["run"].get("bounces", 1)
    if verb == "run" and bounces > 1:
        raise CaseError(f"`run.bounces` = {bounces} makes a recording for each impact: set it to 1, and run them one by one")
    path = Path(output) if output is not None else folder.path / f"{verb}.mcap"
    execute(verb, f"--output={path}", *flags, *given, progress=progress)
    return Recording(path, make, folder if output is None else None)
