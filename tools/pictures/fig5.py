"""Draws the picture of the README from what `percuss-read trace` prints; needs matplotlib.

    percuss run fig5
    percuss-read trace fig5.mcap -o drag.csv
    percuss-read trace fig5.mcap --topic /interface/stress --at r=0,0.5,0.9,0.95 -o stress.csv
    python tools/pictures/fig5.py drag.csv stress.csv tools/pictures/fig5.png
"""

import csv
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

# colours that stay apart for colour-blind readers (Okabe and Ito)
COLOURS = ["#0072B2", "#E69F00", "#009E73", "#CC79A7"]


def columns(path):
    with open(path, encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    return {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}


def main(drag_path, stress_path, picture):
    drag, stress = columns(drag_path), columns(stress_path)
    time = "time [R/c_p]"
    figure, axes = pyplot.subplots(figsize=(8, 4.2), dpi=110)
    axes.plot(drag[time], drag["force [πR²γc_p²]"], color="black", linewidth=2, label="drag F")
    names = [name for name in stress if name.startswith("stress@")]
    for name, colour in zip(names, COLOURS):
        label = name.replace("stress@r=", "p at r = ").split(" [")[0]
        axes.plot(stress[time], stress[name], color=colour, linewidth=1.3, label=label)
    axes.set_xlabel("time  [R/c_p]")
    axes.set_ylabel("interface stress [γc_p²], drag [πR²γc_p²]")
    axes.set_title("Flat punch on a layer, h = R, c_s = c_p/2")
    axes.set_xlim(0, 6)
    axes.set_ylim(0, 14)
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left", frameon=False)
    figure.tight_layout()
    figure.savefig(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
