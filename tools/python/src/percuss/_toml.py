"""Dictionaries as the text of case files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any


def document(tables: Mapping[str, Any]) -> str:
    """A case file of nested dictionaries: keys, then tables."""
    keys = [_entry(key, value) for key, value in tables.items() if not isinstance(value, Mapping)]
    for name, table in tables.items():
        if isinstance(table, Mapping):
            keys += [f"\n[{name}]", *(_entry(key, value) for key, value in table.items())]
    return "\n".join(keys) + "\n"


def arguments(tables: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """Nested dictionaries as arguments, `--set=mesh.cells=50`."""
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from arguments(value, f"{prefix}{key}.")
        else:
            yield f"--set={prefix}{key}={literal(value)}"


def literal(value: Any) -> str:
    """A value as it stands in a case file, in one line; paths, which are those of files, are absolute.

    Raises:
        TypeError: A case file has no such values.
    """
    match value:
        case bool():
            return str(value).lower()
        case str():
            return json.dumps(value, ensure_ascii=False)
        case os.PathLike():
            return literal(str(Path(value).absolute()))
        case Integral():
            return str(int(value))
        case Real():
            return repr(float(value))
        case Mapping():
            return "{ " + ", ".join(_entry(key, part) for key, part in value.items()) + " }"
        case Iterable():
            return "[" + ", ".join(map(literal, value)) + "]"
    raise TypeError(f"{value!r} has no place in a case: numbers, texts, paths, lists and dictionaries have")


def _entry(key: str, value: Any) -> str:
    return f"{key} = {literal(value)}"
