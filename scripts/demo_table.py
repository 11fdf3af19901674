# SPDX-License-Identifier: Apache-2.0
"""Remeshes one model with the command in its three modes, prints what was gained and what it cost, and draws before and after; then
the same for a family of coarser levels.

    demo_table.py BUILD_FOLDER MODEL.obj OUTPUT_FOLDER
"""
import json
import subprocess
import sys
from pathlib import Path

from demo_picture import draw_panels

MODES = ("preserve", "flip", "feature")


def command(*words, statuses=(0,)):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode not in statuses:
        sys.exit(f"{' '.join(str(w) for w in words)}\n{done.stdout}{done.stderr}")
    return json.loads(done.stdout) if done.stdout.strip() else None


def read_obj(path):
    points, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.partition("/")[0]) - 1 for w in words[1:4]])
    return points, faces


def show_family(delmesh, model, output):
    prefix, report_file = output / model.stem, output / f"{model.stem}_family.json"
    command(delmesh, "lod", model, prefix, "--ratios", "0.5,0.2,0.1", "--suffix", "obj", "--report",
            report_file, "--quiet")
    report = json.loads(report_file.read_text())
    panels = []
    print()
    print(f"{'level':10}{'triangles':>10}{'smallest':>10}{'largest':>9}{'distance':>11}{'rms':>9}  stopped by")
    print(f"{'':10}{'':10}{'angle':>10}{'angle':>9}{'(% diagonal)':>20}")
    for i, level in enumerate(report["levels"]):
        command(delmesh, "certify", level["file"], "--quiet")
        angles, deviation = level["angles"], level["deviation"]
        print(f"{i:<10}{level['faces']:>10}{angles['min_angle']:>10.2f}{angles['max_angle']:>9.1f}"
              f"{deviation['hausdorff_percent']:>11.2g}{deviation['rms_percent']:>9.2g}  {level['stopped_by']}")
        moved = deviation["hausdorff_percent"]
        panels.append((f"{level['faces']} triangles, {moved:.2f}%", *read_obj(Path(level["file"])), []))
    print()
    seconds = report["seconds"]
    print(f"Every level is Delaunay, and certified. The family took {1000 * seconds['lod']:.0f} ms, measuring it "
          f"{1000 * seconds['measure']:.0f} ms.")
    draw_panels(output / "family.png", panels)


def main():
    build, model, output = (Path(word) for word in sys.argv[1:4])
    delmesh = build / "cli" / "delmesh"
    before = command(delmesh, "certify", model, "--list", "--json", statuses=(0, 1))
    panels = [(f"before, {len(before['edges'])} edges not Delaunay", *read_obj(model), before["edges"])]
    rows = []
    for mode in MODES:
        result = output / f"{model.stem}_{mode}.obj"
        report_file = output / f"{model.stem}_{mode}.json"
        command(delmesh, "remesh", model, result, "--mode", mode, "--measure", "--report", report_file, "--quiet")
        report = json.loads(report_file.read_text())
        certificate = command(delmesh, "certify", result, "--list", "--json")  # status 0: the file is Delaunay
        quality = report["quality"]
        if not rows:
            rows.append(("before", report["nld_in"], quality["before"], report["vertices_in"], None, None))
        growth = 100.0 * (report["vertices_out"] / report["vertices_in"] - 1)
        distance = report["deviation"]["hausdorff_percent"]
        rows.append((mode, report["nld_out"], quality["after"], report["vertices_out"], (growth, distance),
                     report["seconds"]["remesh"]))
        panels.append((f"{mode}, {growth:.0f}% more vertices, moved {distance:.2f}%", *read_obj(result), certificate["edges"]))
    print()
    print(f"{'':10}{'edges not':>10}{'smallest':>10}{'largest':>9}{'angles':>8}{'vertices':>10}{'growth':>8}{'moved by':>13}"
          f"{'time':>9}")
    print(f"{'':10}{'Delaunay':>10}{'angle':>10}{'angle':>9}{'< 30':>8}{'':10}{'':8}{'(% diagonal)':>13}{'':9}")
    for name, edges, quality, vertices, cost, seconds in rows:
        print(f"{name:10}{edges:>10}{quality['min_angle']:>10.2f}{quality['max_angle']:>9.1f}{quality['percent_below_30']:>7.1f}%"
              f"{vertices:>10}" + (f"{cost[0]:>7.1f}%{cost[1]:>13.2g}{1000 * seconds:>6.1f} ms" if cost else ""))
    print()
    print("preserve keeps the surface and pays with vertices; flip adds hardly any and moves the surface where faces met at an")
    print("angle; feature flips too, but keeps edges sharper than 30 degrees. Every result has been certified exactly.")
    draw_panels(output / "before_and_after.png", panels)
    show_family(delmesh, model, output)


if __name__ == "__main__":
    main()
