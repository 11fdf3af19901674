# SPDX-License-Identifier: Apache-2.0
"""Laws over real meshes: drives the `delmesh` command over the meshes of the shared data and checks what must hold for each.

    run_corpus.py --build DIR [--short | --smoke] [--only TEXT] [--jobs N] [--csv] [--update] [--keep FOLDER] [--no-limits]

DIR is a build folder: its cli/delmesh and tests/certifier/dm_certifier are used. Without --short or --smoke this is the campaign:
every mesh of data/clean, data/compare and data/paper in every mode at both precisions, data/nasty, data/malformed.

For every mesh, of which positions and faces count here (--bare; tests/cli/test_attributes.py has the rest), mode and precision:
    certified    by the command's report, by `delmesh certify` of the written file, and by dm_certifier, which shares no code
    no zero-area face, oriented manifold, components, boundary loops and Euler characteristic of the input
    vertex i of the input is vertex i of the output, bit for bit at the output precision
    preserve     the proven bound is within 4 units in the last place of the largest coordinate, and so are samples of both surfaces
    flip         the area does not grow; preserve: it does not change
    tolerance    at 0, 0.001, 0.01, 0.1 and 1 % of the diagonal: certified, the proven bound is within the tolerance, and samples
                 of both surfaces are within the bound
    same bytes   over a second run and 1, 2, 4 threads
Some meshes: mirrored or scaled by a power of two, the result is exactly the mirrored or scaled one.
data/nasty and data/malformed: no signal, 20 s, 2 GB, a documented status; of the nasty ones with a usable surface 90 % certified.
Named gates: Table 1 of the paper, and the vertices that preserve mode adds.

bench/results/quality.csv holds the figures (never times): --csv writes all of it (campaign only), --short compares what it
measures with it and fails on a difference, --update writes the differences instead.
The last line is "N passed, N failed, N skipped".
"""
import array
import json
import math
import sys
import time

from campaign import DATA, ROOT, Check, is_usable, manifest, run_campaign

TABLE = ROOT / "bench" / "results" / "quality.csv"
MODES, PRECISIONS = ("preserve", "flip", "feature"), ("f32", "f64")

SMOKE = ["standin_hand_294e.off", "fandisk_quads.off", "catmark_torus_creases0.obj", "spot_control_mesh.obj", "112932.stl"]
SHORT = SMOKE + ["fandisk.obj", "spot.obj.gz", "homer.obj.gz", "blub_triangulated.obj", "rocker-arm.obj", "soccerball.obj.gz",
                 "standin_horse_1944e.off", "88566.stl", "catmark_car.obj", "sword.obj.gz", "mech-holes-shark.off"]
LAWS = ["standin_hand_294e.off", "fandisk.obj", "catmark_car.obj", "blade.off", "homer.obj.gz", "mech-holes-shark.off",
        "rocker-arm.obj", "standin_horse_1944e.off", "blub_triangulated.obj"]  # mirrored and scaled; OBJ and OFF only

# Vertices that preserve may add at most: 3 % above a public implementation of the interval rule, measured on the same meshes.
GROWTH = {"homer.obj.gz": 6161, "fandisk.obj": 574, "bunny_104288e.obj.gz": 3304, "armadillo.obj.gz": 9111}
# Of the diagonal, in percent. The short form takes all of them on small meshes.
TOLERANCES = (0, 0.001, 0.01, 0.1, 1)
SHORT_TOLERANCE = ["standin_hand_294e.off", "fandisk.obj", "112932.stl", "homer.obj.gz", "catmark_car.obj", "rocker-arm.obj"]
# With tolerance 0 nothing smaller than the precision may be taken out: here that leaves no room (mesh and precision).
NO_ROOM = {("feline.obj.gz", "f32"), ("counter.unitsmm.STL.gz", "f32")}
# Table 1: flips, min and max angle after, % below 30, % above 120, distance in % of the diagonal and how far from it (or None).
TABLE_1 = {"bunny_104288e.obj.gz": (2202, 7.8, 146.1, 2.1, 0.0, (0.237, 0.03)),
           "horse_59547e_A.off.gz": (2957, 1.6, 164.3, 7.9, 1.2, None)}
# Output files rotate through the formats; STL has no shared vertices to compare and is tried apart.
FORMATS = ("ply", "obj", "off")

COLUMNS = ("mesh", "mode", "precision", "placement", "vertices_in", "vertices_out", "flips", "splits", "min_angle", "max_angle",
           "percent_below_30", "percent_above_120", "hausdorff_percent", "certified")
KEYS = 4


def float_ulp(x, precision):
    """One unit in the last place of x at a precision."""
    x = abs(x)
    if precision == "f64" or x == 0:
        return math.ulp(x)
    return math.ldexp(1.0, max(math.frexp(x)[1] - 24, -149))


# ---- One mesh, mode and precision ------------------------------------------------------------------------------------------


def remesh_case(run, source, mode, precision, extension, placement="interval", repeat=(), laws=True):
    """Remeshes and checks. repeat: the thread counts whose bytes must be the same. laws: off for STL, which keeps no vertices."""
    check = Check(" ".join([source.name, mode, precision, *([placement] if placement != "interval" else []),
                            *([extension] if not laws else [])]))
    stem = f"{source.name}.{mode}.{precision}.{placement}"
    out, report_file = run.folder / f"{stem}.{extension}", run.folder / f"{stem}.json"
    options = ["--mode", mode, "--precision", precision, "--placement", placement, "--quiet"]
    status, _, err = run.call(run.delmesh, "remesh", "--bare", source, out, *options, "--measure", "--report", report_file)
    if not check.equal(status, 0, f"remesh failed ({err.strip()[-200:]}), status"):
        return check
    report = json.loads(report_file.read_text())
    check.that(report["certified"] in (True, 1), "the report is not certified")
    check.equal(report["nld_out"], 0, "nld_out")

    status, certificate = run.json_of(run.delmesh, "certify", out, "--json")
    check.equal((status, certificate.get("delaunay")), (0, True), "delmesh certify of the written file")
    status, info = run.json_of(run.delmesh, "info", source, "--json")
    if not check.equal(status, 0, "delmesh info of the input"):
        return check
    rounding = ["--f32"] if precision == "f32" else []
    plain = run.plain(source)
    # The second opinion cuts polygons into fans, the library where fans do not fold: then only vertices can be compared.
    same_triangles = laws and info["polygons"] == info["faces"]
    ulp = float_ulp(info["largest_coordinate"], precision)
    within = ["--within", repr(4 * ulp)] if mode == "preserve" and same_triangles else []
    status, second = run.second_opinion("--source", plain, *within, *rounding, out)
    if not check.equal(status, 0, f"second opinion {second}"):
        return check
    for key in ("components", "boundary_loops", "euler_characteristic"):
        check.equal(second[key], info.get(key), f"{key} against the input")
        check.equal(certificate.get(key), second[key], f"{key} of certify against the second opinion")
    for key in ("faces", "edges", "boundary_edges"):
        check.equal(certificate.get(key), second[key], f"{key} of certify against the second opinion")
    if laws:
        check.equal(second["vertices"], report["vertices_out"], "vertices in the file against the report")
    check.equal(report["vertices_out"] - report["vertices_in"], report["splits"], "vertices added against splits")
    if laws:
        check.equal(second["moved_vertices"], 0, "input vertices that are not output vertices")

    quality, deviation = report["quality"]["after"], report["deviation"]
    if laws:
        area = report["quality"]["before"]["area"]
        if same_triangles:
            area = run.second_opinion(*rounding, plain)[1]["area"]
        slack = area * (1e-6 if precision == "f32" else 1e-11)
        check.that(second["area"] <= area + slack, f"the area grew from {area} to {second['area']}")
        if mode == "preserve":
            check.that(second["area"] >= area - slack, f"the area fell from {area} to {second['area']}")
    if report["faces_in"] >= 50000 and mode == "flip":
        check.that(report["peak_bytes"] <= 250 * report["faces_in"],
                   f"peak memory of {report['peak_bytes'] / report['faces_in']:.0f} bytes per triangle")
    if mode == "preserve":
        bound = report["surface_bound"]
        check.that(0 <= bound <= 4 * ulp, f"the proven bound is {bound}, {bound / ulp:.3g} units in the last place")
        if within:
            check.equal(second["far_samples"], 0, "samples farther than 4 units in the last place from the other surface")

    for threads in repeat:
        again = run.folder / f"{stem}.again.{extension}"
        status, _, err = run.call(run.delmesh, "remesh", "--bare", source, again, *options, "--threads", threads)
        same = status == 0 and again.read_bytes() == out.read_bytes()
        check.that(same, f"other bytes with --threads {threads} (status {status})")
        again.unlink(missing_ok=True)

    distance = deviation["hausdorff_percent"]
    check.rows.append({
        "mesh": source.name, "mode": mode, "precision": precision, "placement": placement,
        "vertices_in": report["vertices_in"], "vertices_out": report["vertices_out"],
        "flips": report["flips"] + report["flips_after"], "splits": report["splits"],
        "min_angle": f"{quality['min_angle']:.3f}", "max_angle": f"{quality['max_angle']:.3f}",
        "percent_below_30": f"{quality['percent_below_30']:.3f}",
        "percent_above_120": f"{quality['percent_above_120']:.3f}",
        "hausdorff_percent": f"{distance:.3g}" if distance >= 1e-6 else "0",  # below that it is the noise of measuring
        "certified": int(bool(report["certified"])), "_flips": report["flips"]})
    out.unlink()
    report_file.unlink()
    table_1(check)
    return check


def table_1(check):
    row = check.rows[0]
    if (row["mode"], row["precision"], row["placement"]) == ("flip", "f64", "interval") and row["mesh"] in TABLE_1:
        flips, low, high, below, above, distance = TABLE_1[row["mesh"]]
        check.that(abs(row["_flips"] - flips) <= 0.02 * flips, f"Table 1: {row['_flips']} flips, not {flips} +- 2 %")
        for key, wanted in (("min_angle", low), ("max_angle", high), ("percent_below_30", below), ("percent_above_120", above)):
            check.equal(f"{float(row[key]):.1f}", f"{wanted:.1f}", f"Table 1: {key}")
        if distance:
            got = float(row["hausdorff_percent"])
            check.that(abs(got - distance[0]) <= distance[1], f"Table 1: distance {got} %, not {distance[0]} +- {distance[1]}")


def growth_case(run, source, precision):
    """Vertices that preserve adds when only exactly flat places count as flat."""
    check = Check(f"{source.name} preserve {precision}, exact planarity: vertices added")
    out, report_file = run.folder / f"{source.name}.{precision}.growth.ply", run.folder / f"{source.name}.{precision}.growth.json"
    status, _, err = run.call(run.delmesh, "remesh", "--bare", source, out, "--tolerance", 0, "--precision", precision,
                              "--quiet", "--report",
                              report_file)
    if check.equal(status, 0, f"remesh failed ({err.strip()[-200:]}), status"):
        splits, limit = json.loads(report_file.read_text())["splits"], math.floor(1.03 * GROWTH[source.name])
        print(f"{check.name}: {splits} (at most {limit})")
        check.that(splits <= limit, f"{splits}, more than {limit}")
        check.equal(run.second_opinion(out)[0], 0, "second opinion")
        out.unlink()
    return check


def tolerance_case(run, source, percent, precision):
    """preserve may move the surface by a part of the diagonal: what it says it did must be so."""
    check = Check(f"{source.name} preserve {precision} tolerance {percent} %")
    stem = f"{source.name}.{precision}.{percent}"
    out, report_file = run.folder / f"{stem}.ply", run.folder / f"{stem}.json"
    status, _, err = run.call(run.delmesh, "remesh", "--bare", source, out, "--tolerance", f"{percent}%", "--precision", precision,
                              "--quiet",
                              "--report", report_file)
    if percent == 0 and status == 2 and (source.name, precision) in NO_ROOM:
        check.that("The output precision" in err, f"another failure than that there is no room: {err.strip()[-200:]}")
        return check
    if not check.equal(status, 0, f"remesh failed ({err.strip()[-200:]}), status"):
        return check
    report = json.loads(report_file.read_text())
    status, info = run.json_of(run.delmesh, "info", source, "--json")
    if not check.equal(status, 0, "delmesh info of the input"):
        return check
    ulp, bound = float_ulp(info["largest_coordinate"], precision), report["surface_bound"]
    # What the rounding of coordinates alone can do is allowed at any tolerance.
    allowed = max(percent / 100 * info["diagonal"], 4 * ulp) * (1 + 1e-12)
    check.that(0 <= bound <= allowed, f"the proven bound is {bound}, more than {allowed}")
    rounding = ["--f32"] if precision == "f32" else []
    within = []
    if info["polygons"] == info["faces"]:  # the second opinion cuts polygons into other triangles
        within = ["--source", run.plain(source), "--within", repr(bound * (1 + 1e-9) + (1e-3 if precision == "f32" else 1) * ulp)]
    status, second = run.second_opinion(*within, *rounding, out)
    check.equal(status, 0, f"second opinion {second}")
    if within:
        check.equal(second.get("far_samples"), 0, f"samples farther than the bound of {bound} from the other surface")
    for key in ("components", "boundary_loops", "euler_characteristic"):
        check.equal(second.get(key), info.get(key), f"{key} against the input")
    out.unlink()
    report_file.unlink()
    return check


# ---- Mirrored and scaled ---------------------------------------------------------------------------------------------------


def read_text_mesh(path):
    """Positions and polygons of an OBJ or OFF file of the shared data; for the laws only."""
    points, faces = [], []
    text = path.read_text(encoding="ascii", errors="replace")
    if path.suffix.lower() == ".obj":
        for line in text.splitlines():
            words = line.split()
            if words[:1] == ["v"]:
                points.append([float(x) for x in words[1:4]])
            elif words[:1] == ["f"]:
                faces.append([int(w.partition("/")[0]) - 1 for w in words[1:]])
    else:
        lines = [line for line in (part.partition("#")[0].split() for part in text.splitlines()) if line]
        count_vertices, count_faces = int(lines[1][0]), int(lines[1][1])
        points = [[float(x) for x in line[:3]] for line in lines[2:2 + count_vertices]]
        faces = [[int(i) for i in line[1:1 + int(line[0])]] for line in lines[2 + count_vertices:2 + count_vertices + count_faces]]
    return points, faces


def write_off(path, points, faces):
    with open(path, "w", encoding="ascii") as out:
        out.write(f"OFF\n{len(points)} {len(faces)} 0\n")
        out.writelines(f"{p[0]!r} {p[1]!r} {p[2]!r}\n" for p in points)
        out.writelines(f"{len(f)} {' '.join(map(str, f))}\n" for f in faces)


def read_ply_output(path, precision):
    """(coordinates, the bytes of the faces) of a binary PLY as the command writes it."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode("ascii").split("\n")
    if "format binary_little_endian 1.0" not in header:
        raise ValueError("not a little-endian PLY")
    count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
    numbers = array.array("f" if precision == "f32" else "d")
    size = 3 * count * numbers.itemsize
    numbers.frombytes(data[end:end + size])
    return numbers, data[end + size:]


def symmetry_case(run, source, mode, precision):
    check = Check(f"{source.name} {mode} {precision} mirrored and scaled")
    points, faces = read_text_mesh(run.plain(source))
    results = {}
    for label, factors in (("as it is", (1, 1, 1)), ("mirrored", (-1, 1, 1)), ("mirrored twice", (1, -1, -1)),
                           ("scaled by 2^20", (2.0 ** 20,) * 3), ("scaled by 2^-20", (2.0 ** -20,) * 3)):
        stem = f"{source.name}.{mode}.{precision}.{label.replace(' ', '_')}"
        given, out = run.folder / f"{stem}.in.off", run.folder / f"{stem}.ply"
        write_off(given, [[c * x for c, x in zip(factors, p)] for p in points], faces)
        status, _, err = run.call(run.delmesh, "remesh", "--bare", given, out, "--mode", mode, "--precision", precision, "--quiet")
        if check.equal(status, 0, f"{label}: {err.strip()[-200:]}; status"):
            results[label] = factors, *read_ply_output(out, precision)
            out.unlink()
        given.unlink()
    _, base, base_faces = results.get("as it is", (None, None, None))
    for label, (factors, numbers, face_bytes) in results.items():
        if label == "as it is" or base is None:
            continue
        check.that(face_bytes == base_faces, f"{label}: other faces")
        scaled = array.array(base.typecode, (factors[i % 3] * x for i, x in enumerate(base)))
        check.that(scaled == numbers, f"{label}: other coordinates")
    return check


# ---- Bad input -------------------------------------------------------------------------------------------------------------


def nasty_case(run, source, mode, precision, row):
    """Rows of this case: (usable, certified)."""
    check = Check(f"nasty/{source.name} {mode} {precision}")
    out = run.folder / f"nasty.{source.name}.{mode}.{precision}.ply"
    began = time.monotonic()
    status, _, err = run.call(run.delmesh, "remesh", "--bare", source, out, "--mode", mode, "--precision", precision,
                              "--quiet", timeout=20,
                              limited=True)
    seconds = time.monotonic() - began
    check.that(status is not None, f"did not end in 20 s ({seconds:.1f})")
    check.that(status is None or status >= 0, f"ended by signal {-(status or 0)}")
    certified = False
    if status == 0:
        rounding = ["--f32"] if precision == "f32" else []
        answer, second = run.second_opinion(*rounding, out)
        certified = check.equal(answer, 0, f"second opinion {second}")
        status, certificate = run.json_of(run.delmesh, "certify", out, "--json")
        check.equal((status, certificate.get("delaunay")), (0, True), "delmesh certify of the written file")
    elif status is not None and status > 0:
        check.equal(status, 2, f"undocumented exit status ({err.strip()[-200:]})")
        check.that(err.strip() != "", "no sentence says why")
        check.that(not out.exists(), "a half-written file is left")
    out.unlink(missing_ok=True)
    check.usable = is_usable(row, precision)
    check.group = f"{mode} {precision}"
    check.certified = certified
    check.note = err.strip().rpartition(": ")[2]
    return check


def malformed_case(run, source):
    check = Check(f"malformed/{source.name}")
    status, _, err = run.call(run.delmesh, "info", source, "--json", timeout=20, limited=True)
    check.that(status is not None, "did not end in 20 s")
    check.that(status is None or status >= 0, f"ended by signal {-(status or 0)}")
    if status:
        check.equal(status, 2, "exit status")
        check.that(err.strip() != "", "no sentence says why")
    return check


# ---- The run ---------------------------------------------------------------------------------------------------------------


def plan(run, options):
    """The cases as (priority, function, arguments): larger ones first, so that the workers end together."""
    rows = manifest()
    cases = []

    def add(weight, function, *arguments, **named):
        label = arguments[1].name
        if options.only in label:
            cases.append((weight, function, arguments, named))

    chosen = SMOKE if options.smoke else SHORT if options.short else None
    sources = [(DATA / group / name, row) for (group, name), row in rows.items() if group in ("clean", "compare", "paper")]
    for source, row in sources:
        if chosen is not None and source.name not in chosen:
            continue
        edges = int(row["E"])
        for i, (mode, precision) in enumerate((m, p) for m in MODES for p in PRECISIONS):
            short_run = options.short or options.smoke
            repeat = (4,) if short_run else (1, 1, 2, 4)
            add(edges, remesh_case, run, source, mode, precision, FORMATS[(i + len(source.name)) % 3], repeat=repeat)
        if options.smoke:
            continue
        if row["group"] == "clean" and not options.short or source.name in SHORT_TOLERANCE:
            for percent in TOLERANCES:
                for precision in PRECISIONS:
                    add(edges, tolerance_case, run, source, percent, precision)
        if source.name in LAWS and (not options.short or edges < 40000):
            for mode in MODES:
                for precision in PRECISIONS if not options.short else ("f32",):
                    add(edges, symmetry_case, run, source, mode, precision)
        if not options.short and row["dupV"] == "0":
            add(edges, remesh_case, run, source, "preserve", "f32", "stl", laws=False)
    if not options.smoke:
        by_name = {source.name: source for source, _ in sources}
        if options.short:  # the gates on meshes that the short form has not in full
            for name in TABLE_1:
                add(10 ** 6, remesh_case, run, by_name[name], "flip", "f64", "ply")
        for name in GROWTH:
            for precision in PRECISIONS:
                add(10 ** 6, growth_case, run, by_name[name], precision)
        for name in TABLE_1:
            add(10 ** 6, remesh_case, run, by_name[name], "flip", "f64", "ply", placement="shells")
        for (group, name), row in rows.items():
            if group == "nasty":
                for mode in MODES if not options.short else ("preserve", "flip"):
                    for precision in PRECISIONS if not options.short else ("f32",):
                        add(1, nasty_case, run, DATA / group / name, mode, precision, row)
            if group == "malformed":
                add(0, malformed_case, run, DATA / group / name)
    cases.sort(key=lambda case: -case[0])
    return cases


HEAD = (f"{'mesh, mode, precision':58} {'vertices':>15} {'flips':>7} {'splits':>7} {'angles':>13} {'< 30':>6} {'> 120':>6} "
        f"{'distance %':>10}")


def line_of(name, row):
    return (f"{name:58} {row['vertices_in']:>7} {row['vertices_out']:>7} {row['flips']:>7} {row['splits']:>7} "
            f"{float(row['min_angle']):6.1f} {float(row['max_angle']):6.1f} {row['percent_below_30']:>6} "
            f"{row['percent_above_120']:>6} {row['hausdorff_percent']:>10}")


if __name__ == "__main__":
    sys.exit(run_campaign(__doc__.split("\n\n")[0], plan, HEAD, line_of, TABLE, COLUMNS, KEYS))
