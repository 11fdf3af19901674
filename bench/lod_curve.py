# SPDX-License-Identifier: Apache-2.0
"""Distance of levels from the input against their size, plain and with relaxation.

    lod_curve.py --build DIR [--svg FILE] [MESH...]

DIR is a build folder: its cli/delmesh is used. Without meshes: the three of docs/decimate.md, from the shared data. Prints a table,
and with --svg draws docs/pictures/lod.svg, with no other tool than this script.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"
MESHES = ("paper/bunny_104288e.obj.gz", "compare/armadillo.obj.gz", "compare/nefertiti.obj.gz")
RATIOS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd")


def family(program, mesh, folder, *options):
    """The levels of the report, but for the full mesh."""
    report = folder / "report.json"
    done = subprocess.run([program, "lod", "--bare", mesh, folder / "out", "--ratios", ",".join(map(str, RATIOS)), "--quiet",
                           "--report", report, *options], capture_output=True, text=True, timeout=900)
    if done.returncode != 0:
        sys.exit(f"{mesh.name} {' '.join(options)}: {done.stderr.strip()}")
    return json.loads(report.read_text())["levels"][1:]


def percent(level, figure):
    return 100 * level["deviation"][figure] / level["deviation"]["diagonal"]


def table(curves):
    names = [mesh.name.partition(".")[0] for mesh, *_ in curves]
    print("| triangles | " + " | ".join(f"{n}: H / RMS | with `quality`" for n in names) + " |")
    print("|---" * (1 + 2 * len(names)) + "|")
    for i, ratio in enumerate(RATIOS):
        cells = [f"{percent(levels[i], 'hausdorff_sampled'):.2g} / {percent(levels[i], 'rms'):.2g}"
                 for _, *both in curves for levels in both]
        print(f"| {100 * ratio:g} % | " + " | ".join(cells) + " |")


def svg(curves, path):
    """Both axes logarithmic: the share of the triangles, and the root mean square distance in percent of the diagonal."""
    width, height, left, right, top, bottom = 720, 400, 60, 20, 20, 50
    all_of_them = [percent(level, "rms") for _, *both in curves for levels in both for level in levels]
    low, high = math.floor(math.log10(min(all_of_them))), math.ceil(math.log10(max(all_of_them)))
    x_of = lambda share: left + (math.log10(share) + 2) / 2 * (width - left - right)
    y_of = lambda rms: height - bottom - (math.log10(rms) - low) / (high - low) * (height - top - bottom)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
           f'<rect width="{width}" height="{height}" fill="#ffffff"/>']
    text = lambda x, y, s, anchor="middle", colour="#333333": out.append(
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{s}</text>')
    for share in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1):
        out.append(f'<path d="M{x_of(share):.1f} {top}V{height - bottom}" stroke="#dddddd"/>')
        text(x_of(share), height - bottom + 18, f"{100 * share:g} %")
    for exponent in range(low, high + 1):
        out.append(f'<path d="M{left} {y_of(10.0 ** exponent):.1f}H{width - right}" stroke="#dddddd"/>')
        text(left - 8, y_of(10.0 ** exponent) + 4, f"{10.0 ** exponent:g} %", "end")
    text((left + width - right) / 2, height - 12, "triangles, of the input's; distance: root mean square, of the diagonal")
    for i, (mesh, *both) in enumerate(curves):
        colour = COLOURS[i % len(COLOURS)]
        for levels, dashes in zip(both, ("", ' stroke-dasharray="4 4"')):
            points = [(x_of(ratio), y_of(percent(level, "rms"))) for ratio, level in zip(RATIOS, levels)]
            out.append(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" fill="none" stroke="{colour}" '
                       f'stroke-width="2"{dashes}/>')
            out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]
        text(width - right - 6, top + 20 + 18 * i, f"{mesh.name.partition('.')[0]}; dashed: with relaxation", "end", colour)
    out.append("</svg>")
    path.write_text("\n".join(out) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--svg", type=Path)
    parser.add_argument("meshes", nargs="*", type=Path)
    options = parser.parse_args()
    meshes = options.meshes or [DATA / name for name in MESHES]
    program = options.build.resolve() / "cli" / "delmesh"
    with tempfile.TemporaryDirectory() as folder:
        curves = [(mesh, family(program, mesh, Path(folder)), family(program, mesh, Path(folder), "--quality"))
                  for mesh in meshes]
    table(curves)
    if options.svg:
        svg(curves, options.svg)


if __name__ == "__main__":
    main()
