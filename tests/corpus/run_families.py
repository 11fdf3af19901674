# SPDX-License-Identifier: Apache-2.0
"""Laws of decimation over real meshes: drives `delmesh lod` over the meshes of the shared data and checks what must hold for each
level of each family.

    run_families.py --build DIR [--short | --smoke] [--only TEXT] [--jobs N] [--csv] [--update] [--keep FOLDER] [--no-limits]

DIR is a build folder. Without --short or --smoke this is the campaign: every mesh of data/clean, data/compare and data/paper after
flips, CAD with features, a few without moving the surface; data/nasty within limits. A family is the whole Delaunay mesh, 50, 10
and 2 % of the triangles, and as few as can be.

For every level of a family:
    certified    by the command's report, by `delmesh certify` of the written float32 file, and by dm_certifier
    no zero-area face, oriented manifold, components, boundary loops and Euler characteristic of the input
    never more than the target where the report says that it was reached, and no fewer than the last collapse makes of it;
    where it was not reached, the report says why
    parents are vertices of the next level, each of which has children; neighbours go into the same component
    VERT_SOURCE is that vertex bit for bit; the weights of VERT_MAP sum to 1, and the place is as close as the level is
    same bytes   over a second run and 1, 2 threads
Deviation targets of 0.1 % on ten meshes: the bound holds for samples of both surfaces made by dm_certifier, and the vertices are
counted beside those of collapses to end points alone.
Named gates: the paper's Figure 12, and distances at 10 % of the vertices.

bench/results/lod.csv holds the figures (never times): --csv writes all of it (campaign only), --short compares what it measures
with it and fails on a difference, --update writes the differences instead.
The last line is "N passed, N failed, N skipped".
"""
import json
import sys

from campaign import DATA, ROOT, Check, is_usable, manifest, run_campaign

TABLE = ROOT / "bench" / "results" / "lod.csv"
COLUMNS = ("mesh", "mode", "quality", "placement", "level", "vertices", "faces", "stopped_by", "min_angle", "max_angle",
           "hausdorff_percent", "rms_percent")
KEYS = 5
RATIOS = (0.5, 0.1, 0.02, 0)
NAMES = ("all", "50 %", "10 %", "2 %", "least")
TOPOLOGY = ("components", "boundary_loops", "euler_characteristic")

SMOKE = ["standin_hand_294e.off", "fandisk_quads.off", "catmark_torus_creases0.obj", "spot_control_mesh.obj", "112932.stl"]
SHORT = SMOKE + ["fandisk.obj", "spot.obj.gz", "homer.obj.gz", "rocker-arm.obj", "soccerball.obj.gz", "standin_horse_1944e.off",
                 "88566.stl", "catmark_car.obj", "sword.obj.gz", "mech-holes-shark.off", "1002_tray_bottom.STL.gz"]
CAD = ["fandisk.obj", "rocker-arm.obj", "joint.obj.gz", "blade.off", "mech-holes-shark.off", "fandisk_quads.off",
       "tower_holes.obj.gz"]
PRESERVE = ["fandisk.obj", "homer.obj.gz", "standin_hand_294e.off", "face.obj.gz", "soccerball.obj.gz", "bunny_104288e.obj.gz"]
RELAXED = ["standin_hand_294e.off", "spot.obj.gz", "fandisk.obj", "face.obj.gz", "soccerball.obj.gz", "homer.obj.gz"]
# At a deviation of 0.1 %, in modes that do not spend it all on making the mesh Delaunay: five organic ones, five of CAD.
BOUNDED = {"kitten.obj.gz": "flip", "gargoyle.obj.gz": "flip", "face.obj.gz": "flip", "refined_elephant.off.gz": "flip",
           "blub_triangulated.obj": "preserve", "fandisk.obj": "feature", "joint.obj.gz": "feature", "blade.off": "flip",
           "rocker-arm.obj": "preserve", "mech-holes-shark.off": "preserve"}
SHORT_BOUNDED = ["fandisk.obj", "blade.off", "blub_triangulated.obj"]

# Relaxation of all vertices exceeds the distance on these: some move nevertheless.
RELAXED_WITHIN = ["kitten.obj.gz", "blub_triangulated.obj"]

# Vertices, and the most that the two-sided distance to the Delaunay remesh may be, in % of the diagonal.
FIGURE_12 = ("hand_81777e.obj.gz", ((25000, 0.015), (5000, 0.197), (500, 1.189)))
# At 10 % of the vertices, in % of the diagonal: rms without relaxation; distance and rms with it.
AT_TEN_PERCENT = {"bunny_104288e.obj.gz": (0.030, 0.24, 0.025), "armadillo.obj.gz": (0.042, 0.28, 0.035),
                  "nefertiti.obj.gz": (0.018, 0.15, 0.014)}
ACCURATE = ["--quality=6"]
# With features, at 2 % of the triangles or where it stopped before: the distance in % of the diagonal. Features that cannot get
# coarser must not be paid for by everything else. fandisk: between 135 and 125 vertices, with feature angles of 25 to 45 degrees
# alike, one collapse gives a detail up that is 1.1 % in size: the distance was up to 0.75 before and stays below 1.1 down to 120.
# 2 % are 131 vertices, so on which side of that step they are is chance.
FEATURED = {"fandisk.obj": 1.2, "rocker-arm.obj": 2, "joint.obj.gz": 1, "blade.off": 0.5, "mech-holes-shark.off": 3,
            "tower_holes.obj.gz": 1}

# No level has folds, made Delaunay as it may be.
UNFOLDED = ["blade.off", "fandisk.obj", "rocker-arm.obj", "joint.obj.gz", "soccerball.obj.gz", "face.obj.gz"]

STOPS = ("target", "topology", "delaunay", "features", "bound")


def lod(run, source, prefix, *options, timeout=900.0, limited=False):
    """(exit status, the report or None, standard error)."""
    report_file = run.folder / f"{prefix.name}.json"
    status, _, err = run.call(run.delmesh, "lod", "--bare", source, prefix, *options,
                              "--quiet", "--report", report_file, timeout=timeout,
                              limited=limited)
    report = json.loads(report_file.read_text()) if report_file.exists() else None
    report_file.unlink(missing_ok=True)
    return status, report, err.strip()[-300:]


def check_level(run, check, name, path, level, info, boundary=True):
    """Certified by all three, and of the input's topology."""
    check.that(level["certified"] is True, f"{name}: the report says certified: {level['certified']}")
    status, certificate = run.json_of(run.delmesh, "certify", path, "--json")
    check.equal((status, certificate.get("delaunay")), (0, True), f"{name}: delmesh certify of the written file")
    status, second = run.second_opinion("--f32", path)
    if not check.equal(status, 0, f"{name}: second opinion {second}"):
        return False
    for key in TOPOLOGY:
        check.equal(second[key], info.get(key), f"{name}: {key} against the input")
        check.equal(certificate.get(key), second[key], f"{name}: {key} of certify against the second opinion")
    check.equal((second["vertices"], second["faces"]), (level["vertices"], level["faces"]), f"{name}: the file against the report")
    return True


def check_counts(check, name, level, before, target):
    """Against the target in faces: reached and not overshot, or why not."""
    if before:
        check.that(level["vertices"] <= before["vertices"], f"{name}: more vertices than the level before")
    if not check.that(level["stopped_by"] in STOPS, f"{name}: stopped by {level['stopped_by']}"):
        return
    if level["stopped_by"] == "target":
        check.that(level["faces"] <= target, f"{name}: {level['faces']} faces, more than {target}, which is said to be reached")
        if before and before["faces"] > target:
            check.that(level["faces"] >= target - 1, f"{name}: {level['faces']} faces, fewer than {target} asks for")
    else:
        check.that(level["faces"] > target, f"{name}: stopped by {level['stopped_by']} at {level['faces']} faces, within {target}")


def check_arrays(run, check, source, options, levels):
    """What only the C interface shows: parents, sources, maps."""
    status, answer = run.json_of(run.level_check, *options, source)
    if not check.equal(status, 0, f"level_check {answer}"):
        return
    for name, told, found in zip(NAMES, levels, answer["levels"], strict=True):
        check.equal((found["vertices"], found["faces"]), (told["vertices"], told["faces"]), f"{name}: counts, C against command")
        for key in ("invalid", "bad_parents", "no_children", "torn_parents", "bad_sources", "bad_faces", "bad_weights"):
            check.equal(found[key], 0, f"{name}: {key}")
        deviation = told["deviation"]
        level_percent = 100 * deviation["hausdorff_bound"] / deviation["diagonal"]
        check.that(found["map_percent"] <= level_percent + 1e-3,
                   f"{name}: a vertex is {found['map_percent']:.4g} % of the diagonal from its place on the source, the level at "
                   f"most {level_percent:.4g}")
        if source.name in UNFOLDED:
            check.equal(found["folded_edges"], 0, f"{name}: edges between faces folded by more than 160 degrees")
        if found["folded_edges"] > 0:
            check.notes.append(f"{name}: {found['folded_edges']} edges between faces folded by more than 160 degrees "
                               f"(input: {answer['folded_edges']})")


def row_of(source, mode, quality, placement, name, level):
    deviation, quality_of = level["deviation"], level["angles"]
    def percent(key):
        return f"{deviation[key]:.4g}" if deviation[key] >= 1e-6 else "0"
    return {"mesh": source.name, "mode": mode, "quality": quality, "placement": placement, "level": name,
            "vertices": level["vertices"], "faces": level["faces"], "stopped_by": level["stopped_by"],
            "min_angle": f"{quality_of['min_angle']:.3f}", "max_angle": f"{quality_of['max_angle']:.3f}",
            "hausdorff_percent": percent("hausdorff_percent"), "rms_percent": percent("rms_percent")}


def family_case(run, source, mode, quality=0, repeat=(1, 2)):
    check = Check(" ".join([source.name, mode, *([f"quality {quality}"] if quality else [])]))
    stem = f"{source.name}.{mode}.{quality}"
    options, relaxed = ["--mode", mode, "--precision", "f32"], [f"--quality={quality}"]
    targets = ["--ratios", ",".join(map(str, RATIOS))]
    status, info = run.json_of(run.delmesh, "info", source, "--json")
    if not check.equal(status, 0, f"delmesh info of the input {info}"):
        return check
    status, report, err = lod(run, source, run.folder / stem, *options, *relaxed, *targets)
    if not check.equal(status, 0, f"lod failed ({err}), status"):
        return check
    levels = report["levels"]
    check.equal(len(levels), len(NAMES), "levels")
    files = [run.folder / f"{stem}_LOD{i}.ply" for i in range(len(levels))]
    for i, (name, path, level) in enumerate(zip(NAMES, files, levels)):
        if check_level(run, check, name, path, level, info) and i > 0:
            check_counts(check, name, level, levels[i - 1], int(RATIOS[i - 1] * report["faces_in"]))
        check.rows.append(row_of(source, mode, quality, "all", name, level))
    if mode == "feature" and source.name in FEATURED:
        distance, limit = levels[NAMES.index("2 %")]["deviation"]["hausdorff_percent"], FEATURED[source.name]
        check.that(distance <= limit, f"2 %: {distance:.4g} % of the diagonal away, more than {limit}")
    check_arrays(run, check, source, [*options, "--quality", quality], levels)
    for threads in repeat:
        again = run.folder / f"{stem}.again"
        status, _, err = lod(run, source, again, *options, *relaxed, *targets, "--no-measure", "--threads", threads)
        check.equal(status, 0, f"--threads {threads}: {err}; status")
        for i, path in enumerate(files):
            other = run.folder / f"{again.name}_LOD{i}.ply"
            same = other.exists() and path.exists() and other.read_bytes() == path.read_bytes()
            check.that(same, f"{NAMES[i]}: other bytes with --threads {threads}")
            other.unlink(missing_ok=True)
    for path in files:
        path.unlink(missing_ok=True)
    return check


def deviation_case(run, source, mode, percent):
    """As few vertices as stay within a part of the diagonal; collapses to end points alone for comparison."""
    check = Check(f"{source.name} {mode} deviation {percent} %")
    status, info = run.json_of(run.delmesh, "info", source, "--json")
    if not check.equal(status, 0, f"delmesh info of the input {info}"):
        return check
    counts = {}
    for placement in ("all", "endpoints"):
        stem = f"{source.name}.{mode}.{placement}.{percent}"
        status, report, err = lod(run, source, run.folder / stem, "--mode", mode, "--deviation", f"{percent}%",
                                  "--collapse-placement", placement)
        if not check.equal(status, 0, f"{placement}: lod failed ({err}), status"):
            continue
        files = [run.folder / f"{stem}_LOD{i}.ply" for i in range(2)]
        name, level = f"{percent} % off, {placement}", report["levels"][1]
        allowed = percent / 100 * info["diagonal"] * (1 + 1e-12)
        check_level(run, check, name, files[1], level, info)
        if level["stopped_by"] != "bound":  # else nothing was done, as making the mesh Delaunay had spent it
            bound, measured = level.get("bound", -1), level["deviation"]["hausdorff_sampled"]
            check.that(0 <= bound <= allowed, f"{name}: the proven bound is {bound}, more than {allowed}")
            # On coordinates as they are: the level's are float32 numbers, the source's are not rounded.
            status, second = run.second_opinion("--source", run.plain(source), "--within", repr(allowed), files[1])
            if info["polygons"] == info["faces"]:
                check.equal(second.get("far_samples"), 0, f"{name}: samples farther than the bound from the other surface")
            check.that(measured <= allowed, f"{name}: measured {measured}, more than {allowed}")
        counts[placement] = level["vertices"]
        check.rows.append(row_of(source, mode, 0, placement, f"{percent} % off", level))
        for path in files:
            path.unlink(missing_ok=True)
    if source.name in RELAXED_WITHIN:
        stem = f"{source.name}.{mode}.relaxed.{percent}"
        status, report, err = lod(run, source, run.folder / stem, "--mode", mode, "--deviation", f"{percent}%", *ACCURATE)
        if check.equal(status, 0, f"relaxed: lod failed ({err}), status"):
            level, allowed = report["levels"][1], percent / 100 * info["diagonal"] * (1 + 1e-12)
            check.equal(level["vertices"], counts.get("all"), "relaxed: vertices")
            check.that(level["relaxed_vertices"] > 0, "relaxed: no vertex was moved")
            check.that(level["deviation"]["hausdorff_sampled"] <= allowed, "relaxed: farther than the bound")
            check_level(run, check, "relaxed", run.folder / f"{stem}_LOD1.ply", level, info)
        for i in range(2):
            (run.folder / f"{stem}_LOD{i}.ply").unlink(missing_ok=True)
    if len(counts) == 2:
        check.notes.append(f"{counts['all']} vertices, {counts['endpoints']} with end points alone: "
                           f"{counts['endpoints'] / counts['all']:.2f} times")
    return check


def figure_12_case(run, source):
    """The hand of the paper's Figure 12: the distance to the Delaunay remesh."""
    check = Check(f"{source.name} Figure 12")
    stem = f"{source.name}.figure12"
    counts = ",".join(str(vertices) for vertices, _ in FIGURE_12[1])
    status, report, err = lod(run, source, run.folder / stem, "--vertices", counts, "--no-measure")
    if not check.equal(status, 0, f"lod failed ({err}), status"):
        return check
    first = run.folder / f"{stem}_LOD0.ply"
    for i, (vertices, gate) in enumerate(FIGURE_12[1], 1):
        check.equal(report["levels"][i]["vertices"], vertices, f"level {i}: vertices")
        path = run.folder / f"{stem}_LOD{i}.ply"
        status, distance = run.json_of(run.delmesh, "measure", first, path, "--json")
        got = distance.get("hausdorff_percent", distance.get("deviation", {}).get("hausdorff_percent"))
        if check.equal(status, 0, f"level {i}: delmesh measure {distance}"):
            check.notes.append(f"{vertices} vertices: {got:.4f} % (paper: {gate} %)")
            check.that(got <= gate, f"{vertices} vertices: {got:.4f} %, more than {gate} %")
        path.unlink(missing_ok=True)
    first.unlink(missing_ok=True)
    return check


def gate_case(run, source):
    """Distances at 10 % of the vertices, with relaxation and without."""
    check = Check(f"{source.name} at 10 % of the vertices")
    plain_rms, far, rms = AT_TEN_PERCENT[source.name]
    status, info = run.json_of(run.delmesh, "info", source, "--json")
    if not check.equal(status, 0, f"delmesh info of the input {info}"):
        return check
    for options, limits in (([], (None, plain_rms)), (ACCURATE, (far, rms))):
        name = "with relaxation" if options else "plain"
        stem = f"{source.name}.gate.{len(options)}"
        status, report, err = lod(run, source, run.folder / stem, "--vertices", info["vertices"] // 10, *options)
        for i in range(2):
            (run.folder / f"{stem}_LOD{i}.ply").unlink(missing_ok=True)
        if not check.equal(status, 0, f"{name}: lod failed ({err}), status"):
            continue
        got = [report["levels"][1]["deviation"][key] for key in ("hausdorff_percent", "rms_percent")]
        check.notes.append(f"{name}: {got[0]:.4f} %, rms {got[1]:.5f} %")
        for value, limit, what in zip(got, limits, ("distance", "rms")):
            if limit is not None:
                check.that(value <= limit, f"{name}: {what} {value:.5f} %, more than {limit} %")
    return check


def nasty_case(run, source, row):
    """No signal, 20 s, 2 GB, a documented status; every level that is written is certified and has the topology of level 0."""
    check = Check(f"nasty/{source.name} lod")
    stem = f"nasty.{source.name}"
    status, report, err = lod(run, source, run.folder / stem, "--ratios", ",".join(map(str, RATIOS)), "--no-measure", timeout=20,
                              limited=True)
    check.that(status is not None, "did not end in 20 s")
    check.that(status is None or status >= 0, f"ended by signal {-(status or 0)}")
    files = [run.folder / f"{stem}_LOD{i}.ply" for i in range(len(NAMES))]
    check.certified = False
    if status == 0:
        first = None
        for name, path, level in zip(NAMES, files, report["levels"]):
            answer, second = run.second_opinion("--f32", path)
            check.certified = check.equal(answer, 0, f"{name}: second opinion {second}") and (first is None or check.certified)
            first = first or second
            for key in TOPOLOGY:
                check.equal(second.get(key), first.get(key), f"{name}: {key} against level 0")
            check.that(level["certified"] is True, f"{name}: not certified by the report")
    elif status is not None and status > 0:
        check.equal(status, 2, f"undocumented exit status ({err})")
        check.that(err != "", "no sentence says why")
        check.that(not any(path.exists() for path in files), "a file is left")
    for path in files:
        path.unlink(missing_ok=True)
    check.usable, check.group, check.note = is_usable(row, "f32"), "lod f32", err.rpartition(": ")[2]
    return check


def plan(run, options):
    """The cases as (priority, function, arguments): larger ones first, so that the workers end together."""
    rows = manifest()
    cases = []

    def add(weight, function, *arguments, **named):
        if options.only in arguments[1].name:
            cases.append((weight, function, arguments, named))

    chosen = SMOKE if options.smoke else SHORT if options.short else None
    sources = [(DATA / group / name, row) for (group, name), row in rows.items() if group in ("clean", "compare", "paper")]
    by_name = {source.name: source for source, _ in sources}
    for source, row in sources:
        if chosen is not None and source.name not in chosen:
            continue
        edges, short_run = int(row["E"]), options.short or options.smoke
        repeat = (2,) if short_run else (1, 2)
        add(edges, family_case, run, source, "flip", repeat=repeat)
        if source.name in CAD:
            add(edges, family_case, run, source, "feature", repeat=repeat)
        if source.name in PRESERVE:
            add(edges, family_case, run, source, "preserve", repeat=repeat)
        if source.name in RELAXED:
            add(edges, family_case, run, source, "flip", quality=6, repeat=repeat)
    if not options.smoke:
        for name in SHORT_BOUNDED if options.short else BOUNDED:
            add(10 ** 5, deviation_case, run, by_name[name], BOUNDED[name], 0.1)
        add(10 ** 5, deviation_case, run, by_name["feline.obj.gz"], "flip", 0.1)  # flips spend it
        add(10 ** 6, figure_12_case, run, by_name[FIGURE_12[0]])
        for name in AT_TEN_PERCENT:
            add(10 ** 6, gate_case, run, by_name[name])
        for (group, name), row in rows.items():
            if group == "nasty":
                add(1, nasty_case, run, DATA / group / name, row)
    cases.sort(key=lambda case: -case[0])
    return cases


HEAD = (f"{'mesh, mode':44} {'level':>9} {'placement':>9} {'verts':>7} {'faces':>7} {'angles':>13} {'distance%':>9} {'rms %':>9} "
        f"{'stopped':>8}")


def line_of(name, row):
    return (f"{name:44} {row['level']:>9} {row['placement']:>9} {row['vertices']:>7} {row['faces']:>7} "
            f"{float(row['min_angle']):6.1f} {float(row['max_angle']):6.1f} {row['hausdorff_percent']:>9} "
            f"{row['rms_percent']:>9} {row['stopped_by']:>8}")


if __name__ == "__main__":
    sys.exit(run_campaign(__doc__.split("\n\n")[0], plan, HEAD, line_of, TABLE, COLUMNS, KEYS))
