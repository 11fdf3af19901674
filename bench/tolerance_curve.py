# SPDX-License-Identifier: Apache-2.0
"""Vertices that `preserve` adds against the tolerance, from exact planarity to where it meets `flip`.

    tolerance_curve.py --build DIR [--svg FILE] [--effort N] [MESH...]

DIR is a build folder: its cli/delmesh is used. Without meshes: one organic model and one of CAD, from the shared data. Prints the
table of docs/remesh.md, and with --svg draws docs/pictures/tolerance.svg, with no other tool than this script.
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
MESHES = ("paper/bunny_104288e.obj.gz", "clean/fandisk.obj")
PERCENT = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3)
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd")


def remesh(program, mesh, folder, *options):
    report = folder / "report.json"
    done = subprocess.run([program, "remesh", "--bare", mesh, folder / "out.ply", "--quiet", "--report", report, *options],
                          capture_output=True, text=True, timeout=600)
    if done.returncode != 0:
        sys.exit(f"{mesh.name} {' '.join(options)}: {done.stderr.strip()}")
    return json.loads(report.read_text())


def measure(program, mesh, folder, effort):
    """[(name, percent or None, report)], the diagonal, and the report of flip."""
    info = json.loads(subprocess.run([program, "info", mesh, "--json"], capture_output=True, text=True, check=True).stdout)
    rows = [("0", None, remesh(program, mesh, folder, "--tolerance", "0", *effort)),
            ("default", None, remesh(program, mesh, folder, *effort))]
    rows += [(f"{p:g} %", p, remesh(program, mesh, folder, "--tolerance", f"{p}%", *effort)) for p in PERCENT]
    return rows, info["diagonal"], remesh(program, mesh, folder, "--mode", "flip", "--measure")


def table(curves):
    names = [mesh.name.partition(".")[0] for mesh, *_ in curves]
    print("| tolerance | " + " | ".join(f"{n}: added | bound, % | flips that move" for n in names) + " |")
    print("|---" * (1 + 3 * len(names)) + "|")
    for i, (label, *_) in enumerate(curves[0][1]):
        cells = []
        for _, rows, diagonal, _ in curves:
            r = rows[i][2]
            cells += [f"{r['splits']:,}", f"{100 * r['surface_bound'] / diagonal:.2g}",
                      f"{r['repairs']['moved_within_tolerance']:,}"]
        print(f"| {label} | " + " | ".join(cells) + " |")
    cells = []
    for _, _, _, flip in curves:
        cells += [f"{flip['splits']:,}", f"{flip['deviation']['hausdorff_percent']:.2g} (measured)", f"{flip['flips']:,} in all"]
    print("| `flip` | " + " | ".join(cells) + " |")


def svg(curves, path):
    """Tolerance on a logarithmic axis, added vertices as a part of those with tolerance 0."""
    width, height, left, right, top, bottom = 720, 400, 60, 20, 20, 50
    low, high = math.log10(PERCENT[0]), math.log10(PERCENT[-1])
    x_of = lambda p: left + (math.log10(p) - low) / (high - low) * (width - left - right)
    y_of = lambda share: height - bottom - share * (height - top - bottom)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
           f'<rect width="{width}" height="{height}" fill="#ffffff"/>']
    text = lambda x, y, s, anchor="middle", colour="#333333": out.append(
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{s}</text>')
    for exponent in range(round(low), math.floor(high) + 1):
        x = x_of(10 ** exponent)
        out.append(f'<path d="M{x:.1f} {top}V{height - bottom}" stroke="#dddddd"/>')
        text(x, height - bottom + 18, f"{10.0 ** exponent:g} %")
    for i in range(5):
        y = y_of(i / 4)
        out.append(f'<path d="M{left} {y:.1f}H{width - right}" stroke="#dddddd"/>')
        text(left - 8, y + 4, f"{25 * i} %", "end")
    text((left + width - right) / 2, height - 12, "tolerance, of the diagonal")
    for i, (mesh, rows, diagonal, flip) in enumerate(curves):
        colour, all_of_them = COLOURS[i % len(COLOURS)], max(1, rows[0][2]["splits"])
        points = [(x_of(p), y_of(r["splits"] / all_of_them)) for _, p, r in rows if p is not None]
        out.append(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" fill="none" stroke="{colour}" '
                   'stroke-width="2"/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]
        y = y_of(flip["splits"] / all_of_them)
        out.append(f'<path d="M{left} {y:.1f}H{width - right}" stroke="{colour}" stroke-dasharray="4 4"/>')
        name = mesh.name.partition(".")[0]
        text(width - right - 6, top + 20 + 18 * i,
             f"{name}: 100 % is {rows[0][2]['splits']:,} added vertices; dashed: flip, {flip['splits']:,}", "end", colour)
    out.append("</svg>")
    path.write_text("\n".join(out) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--svg", type=Path)
    parser.add_argument("--effort", type=int)
    parser.add_argument("meshes", nargs="*", type=Path)
    options = parser.parse_args()
    meshes = options.meshes or [DATA / name for name in MESHES]
    effort = [] if options.effort is None else ["--effort", str(options.effort)]
    program = options.build.resolve() / "cli" / "delmesh"
    with tempfile.TemporaryDirectory() as folder:
        curves = [(mesh, *measure(program, mesh, Path(folder), effort)) for mesh in meshes]
    table(curves)
    if options.svg:
        svg(curves, options.svg)


if __name__ == "__main__":
    main()
