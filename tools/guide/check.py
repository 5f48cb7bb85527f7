"""Checks of the guide.

    check.py commands PROGRAMS      runs what the chapters show
    check.py reference PROGRAMS     the reference against what the programs know
    check.py links BOOK             links and anchors of the built book

Blocks of a chapter are taken in their order, each chapter in a folder of its own:

* `console`: lines that begin with `$ ` are commands, `\\` at the end continues them, `# exit 1` says that another status than 0 is
  right. Lines below stand in what the command prints, in this order; `…` stands for lines left out.
* any other language and a name, as in `toml plate.toml`: a file.
* `python`: run by this Python, with the names of the blocks before.
"""

import contextlib
import html.parser
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.parse

HERE = pathlib.Path(__file__).resolve().parent
CHAPTERS = HERE / "src"


def blocks(chapter):
    """Language, name of the file and text of all blocks of a chapter."""
    text = (CHAPTERS / chapter).read_text()
    return [(words.split(), body) for words, body in re.findall(r"^```([^\n`]+)\n(.*?)^```$", text, re.M | re.S)]


def run_console(text, environment):
    """Runs the commands of a block; compares status and what is printed."""
    commands = []
    for line in text.replace("\\\n", " ").splitlines():
        if line.startswith("$ "):
            commands.append((line[2:], []))
        elif line.strip() not in ("", "…"):
            commands[-1][1].append(line.strip())
    for command, shown in commands:
        expected = re.search(r"# exit (\d+)", command)
        done = subprocess.run(
            ["bash", "-c", command], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, timeout=100,
        )
        place = 0
        for line in shown:
            found = done.stdout.find(line, place)
            assert found >= 0, f"$ {command}\ndoes not print, where it is shown: {line}\n\n{done.stdout}"
            place = found + len(line)
        assert done.returncode == int(expected[1] if expected else 0), (
            f"$ {command}\nexit status {done.returncode}\n{done.stdout}"
        )
    return len(commands)


def run_chapters(programs):
    environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "COLUMNS": "120"}
    for chapter in sorted(path.name for path in CHAPTERS.glob("*.md")):
        names, number = {}, 0
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            for words, text in blocks(chapter):
                if words == ["console"]:
                    number += run_console(text, environment)
                elif words == ["python"]:
                    with contextlib.redirect_stdout(io.StringIO()):
                        exec(compile(text, f"{chapter}, python", "exec"), names)
                    number += 1
                elif len(words) == 2:
                    pathlib.Path(words[1]).write_text(text)
            os.chdir(HERE)
        print(f"{chapter}: {number} commands")


def rows(chapter, level):
    """First cells in code and further cells of the tables below every heading of a level."""
    tables, heading = {}, None
    for line in (CHAPTERS / chapter).read_text().splitlines():
        if line.startswith("#" * level + " "):
            heading = line.lstrip("# ").strip("`")
        elif heading and line.startswith("| `"):
            first, *cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
            tables.setdefault(heading, {})[first.strip("`")] = cells
    return tables


def output(*command):
    """All that a command prints, whatever its status is."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.stdout


def check_reference(programs):
    percuss, reader = programs / "percuss", programs / "percuss-read"
    check_units(percuss)
    check_copies()
    for program in (percuss, reader):
        listed = output(program, "--help").split("Commands:")[1].split("Options:")[0]
        verbs = set(re.findall(r"^  (\w+)", listed, re.M)) - {"help"}
        same(set(rows("commands.md", 2)[program.name]), verbs, f"verbs of {program.name}")
    check_topics(percuss, reader)


def check_units(percuss):
    """Units of physical cases are those that the program offers for a number without one."""
    keys = {
        "length": "target.thickness", "time": "run.end_time", "speed": "impact.velocity", "mass": "indenter.mass",
        "density": "target.material.density", "mass, plane": "indenter.mass",
    }
    page = (CHAPTERS / "case.md").read_text().split("## Units")[1].split("\n## ")[0]
    for dimension, key in keys.items():
        geometry = "plane" if "plane" in dimension else "axisymmetric"
        printed = output(percuss, "check", "ball", "--set", f"geometry={geometry}", "--set", f'{key}="7"')
        offered = re.search(r'such as "[^"]*", in ((?:[^\s,]+(?:,\s+)?)+)', printed)
        row = re.search(rf"^\| {dimension} \|.*\|(.*)\|$", page, re.M)
        same(set(re.findall(r"`(.*?)`", row[1])), set(re.findall(r"[^\s,]+", offered[1])) - {"or"}, f"units of {dimension}")


def check_topics(percuss, reader):
    """Topics of the page are those of a recording that has all of them."""
    with tempfile.TemporaryDirectory() as folder:
        recording = f"{folder}/all.mcap"
        sensor = 'record.sensor=[{ r = "0 mm" }]'
        output(percuss, "run", "laminate-glass", "--set", "mesh.cells=20", "--set", sensor, "-o", recording)
        topics = [channel["topic"] for channel in json.loads(output(reader, "info", recording, "--json"))["channels"]]
    names = {re.sub(r"^/field/.*", "/field/…", re.sub(r"^/(line|sensor)/.*", r"/\1/<n>", topic)) for topic in topics}
    same(set(rows("recording.md", 2)["Channels"]), names, "topics")
    print(f"{len(names)} topics")


def check_copies():
    """Tables that stand in the documentation too have the same rows there."""
    for chapter, heading, source in [("performance.md", "Solver", "tools/bench/src/lib.rs")]:
        lines = (HERE.parents[1] / source).read_text().splitlines()
        documented = {line.removeprefix("//! ") for line in lines}
        for row in re.findall(r"^\|.*", (CHAPTERS / chapter).read_text().split(f"## {heading}\n")[1], re.M):
            assert row in documented, f"{chapter}: not in {source}: {row}"


def same(page, program, what):
    assert page == program, f"{what}: the guide has {page}, the program {program}"


class Page(html.parser.HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        for key, value in attributes:
            if key in ("href", "src") and value:
                self.links.append(value)
            elif key == "id":
                self.anchors.add(value)


def check_links(book):
    listed = re.findall(r"\]\((\S+\.md)\)", (CHAPTERS / "SUMMARY.md").read_text())
    same(set(listed) | {"SUMMARY.md"}, {path.name for path in CHAPTERS.glob("*.md")}, "chapters")
    pages = {path.name: Page(path) for path in book.glob("*.html")}
    number = 0
    for name, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            number += 1
            if parts.scheme or parts.netloc:
                assert parts.scheme == "https" and "." in parts.netloc, f"{name}: {link}"
                continue
            path = urllib.parse.unquote(parts.path) or name
            # files of the repository, from the folder of the chapters
            assert (book / path).exists() or (CHAPTERS / path).resolve().exists(), f"{name}: no file {link}"
            if parts.fragment and path in pages:
                anchor = urllib.parse.unquote(parts.fragment)
                assert anchor in pages[path].anchors, f"{name}: no anchor {link}"
    print(f"{len(pages)} pages, {number} links")


what, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
{"commands": run_chapters, "reference": check_reference, "links": check_links}[what](folder)
