// SPDX-License-Identifier: Apache-2.0
// The driver: make Delaunay, collapse to one target after the other, hand out each level.
#include "algo/decimate.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "algo/certify.h"
#include "algo/decimator.h"
#include "algo/level.h"
#include "algo/level_map.h"
#include "algo/measure.h"
#include "algo/relax_within.h"
#include "algo/remesh.h"
#include "base/stopwatch.h"
#include "geom/angle.h"

namespace dm {
namespace {

delmesh_remesh_options how_to_prepare(const delmesh_decimate_options& options) {
    delmesh_remesh_options o{};
    o.struct_size = sizeof o;
    o.mode = options.prepare;
    o.boundary = options.boundary;
    o.precision = options.precision;
    o.strict = options.strict;
    o.compact = 1;
    o.effort = 1;
    o.feature_angle = options.feature_angle;
    o.max_normal_turn = -1;
    o.tolerance = options.tolerance;
    o.map = options.map;
    o.release = options.release;
    return o;
}

// What a vertex of the Delaunay mesh has of the source's: its own, or of the vertices that it lies between.
double from_source(const Mesh& full, int32_t v, const double* values) {
    const int32_t source = full.vert_source.empty() ? v : full.vert_source[v];
    if (source >= 0) return values[source];
    const VertexMap& map = full.split_map[v - full.first_split];
    return map.weight[0] * values[map.vert[0]] + map.weight[1] * values[map.vert[1]] + map.weight[2] * values[map.vert[2]];
}

// The most vertices and faces that a target allows; a deviation allows any number.
void limits_of(const delmesh_target& target, const Mesh& in, int64_t& vertices, int64_t& faces) {
    constexpr int64_t kAny = std::numeric_limits<int64_t>::max();
    vertices = faces = kAny;
    switch (target.kind) {
    case DELMESH_TARGET_VERTICES:
        vertices = static_cast<int64_t>(target.value);
        break;
    case DELMESH_TARGET_FACES:
        faces = static_cast<int64_t>(target.value);
        break;
    case DELMESH_TARGET_RATIO:
        faces = static_cast<int64_t>(target.value * in.faces());
        break;
    case DELMESH_TARGET_DEVIATION:
        vertices = faces = 0;
        break;
    default:
        break;
    }
}

} // namespace

Status decimate(Context& context, const Mesh& in, const delmesh_target* targets, int32_t count,
                const delmesh_decimate_options& options, const DecimationInput& input, Mesh* const* out,
                delmesh_level_report* levels, delmesh_decimate_report& report) {
    Stopwatch watch;
    report.vertices_in = in.vertices();
    report.faces_in = in.faces();
    delmesh_remesh_options prepare = how_to_prepare(options);
    const bool has_weights = Wedges::are_needed(in);
    if (has_weights) prepare.map = 1;
    // The Delaunay mesh, which is the first level where that is to be all of it. It gets its last names when all levels are made.
    const bool is_level = targets[0].kind == DELMESH_TARGET_FULL;
    Mesh apart(context.memory());
    Mesh& full = is_level ? *out[0] : apart;
    {
        const Context::Part part(context, 0, 0.2);
        delmesh_remesh_report done{};
        done.struct_size = sizeof done;
        done.surface_bound = -1;
        const Status status = remesh(context, in, prepare, full, done, nullptr, input.face_mask);
        report.prepare_nld = done.nld_in;
        report.prepare_flips = done.flips + done.flips_after;
        report.prepare_splits = done.splits;
        report.prepare_bound = done.surface_bound;
        report.topology_kept = done.topology_kept;
        DM_TRY(status);
    }
    report.seconds_prepare = watch.lap();

    DM_TRY(context.stage("decimate", 0.2, 0.3));
    DecimationRules rules;
    rules.precision = full.precision;
    rules.boundary_rule = options.boundary == DELMESH_BOUNDARY_NONOBTUSE;
    rules.optimum = rules.flips = rules.middle = options.collapse_placement == DELMESH_COLLAPSE_ALL;
    rules.region = options.collapse_placement != DELMESH_COLLAPSE_ENDPOINTS;
    rules.ends = options.collapse_placement != DELMESH_COLLAPSE_PAPER;
    if (options.collapse_placement == DELMESH_COLLAPSE_ENDPOINTS) rules.flips = true;
    rules.boundary_weight = options.boundary_weight;
    rules.fold_cosine = cosine_of_degrees(options.max_normal_turn);
    SpatialOrder order(context.memory());
    Mesh sorted(context.memory());
    DM_TRY(sort_in_space(context, full, order, sorted));
    if (options.map == 0 && !is_level) { // what it has of the source is all that is still needed of it
        for (Array<int32_t>* each : {&full.corner_vert, &full.corner_twin}) each->free_storage();
        full.corner_bits.free_storage();
        full.pos32.free_storage();
        full.pos64.free_storage();
    }
    Surface surface(context, sorted, full.precision);
    sorted = Mesh(context.memory());
    DM_TRY(context.progress(0));
    surface.kept_bits = static_cast<EdgeBits>(surface.kept_bits & ~options.release);
    for (EdgeBits& bits : surface.corner_bits)
        bits &= static_cast<EdgeBits>(~kEdgeSource); // what collapses leave is no edge of the source
    Array<double> weights(context.memory());
    Array<uint8_t> locked(context.memory());
    if (input.vert_weights != nullptr)
        for (const int32_t v : order.old_vert) weights.push_back(from_source(full, v, input.vert_weights));
    if (input.locked_verts != nullptr)
        for (const int32_t v : order.old_vert) {
            const int32_t source = full.vert_source.empty() ? v : full.vert_source[v];
            locked.push_back(source >= 0 ? input.locked_verts[source] : 0);
        }
    Decimator decimator(context, surface, rules);
    if (has_weights) DM_TRY(decimator.wedges.begin(context, in, full, order, surface));
    DM_TRY(decimator.begin(weights.empty() ? nullptr : weights.data(), locked.empty() ? nullptr : locked.data()));
    LevelMaker maker(context, in, full, order, surface, decimator);
    report.seconds_decimate += watch.lap();

    const auto certify = [&](int32_t i) -> Status {
        Certificate certificate;
        DM_TRY(certify_unfrozen(context, *out[i], rules.boundary_rule, certificate, levels[i].nld_outside));
        levels[i].certified = certificate.delaunay(rules.boundary_rule) ? 1 : 0;
        levels[i].vertices = out[i]->vertices();
        levels[i].faces = out[i]->faces();
        if (levels[i].certified != 0) return DELMESH_OK;
        return context.fail(DELMESH_ERROR_INTERNAL, "Level %d was not Delaunay: %lld NLD edges, %lld faces without area.", i,
                            static_cast<long long>(certificate.nld_interior + certificate.nld_boundary),
                            static_cast<long long>(certificate.zero_area_faces));
    };
    const auto thaw = [&](Mesh& mesh) {
        if (input.face_mask == nullptr) return;
        for (EdgeBits& bits : mesh.corner_bits) bits &= static_cast<EdgeBits>(~kEdgeFrozen);
    };
    std::optional<LevelMap> corner_maps;
    Array<uint8_t> stays(context.memory());
    bool pruned = false;
    for (int32_t i = 0; i < count; ++i) {
        const double from = 0.3 + 0.7 * i / count, to = 0.3 + 0.7 * (i + 1) / count;
        delmesh_level_report& level = levels[i];
        level.bound = -1;
        if (i == 0 && is_level) {
            DM_TRY(context.stage("export", from, to));
            DM_TRY(certify(i));
            level.stopped_by = DELMESH_STOPPED_BY_TARGET;
            level.seconds = watch.lap();
            report.seconds_export += level.seconds;
            continue;
        }
        const double begin = from + 0.2 * (to - from), middle = from + 0.7 * (to - from);
        const bool bounded = targets[i].kind == DELMESH_TARGET_DEVIATION;
        bool within = true;
        DM_TRY(context.stage("decimate", from, from));
        DM_TRY(decimator.wake());
        {
            DeviationGuard guard(context, surface); // large: gone before anything else begins
            if (bounded) {
                DM_TRY(context.stage("associate", from, begin));
                DM_TRY(guard.begin(in, targets[i].value, within));
                decimator.guard = &guard;
            }
            DM_TRY(context.stage("decimate", bounded ? begin : from, middle));
            if (!bounded && !pruned && targets[i].kind != DELMESH_TARGET_FULL) {
                pruned = true;
                DM_TRY(decimator.prune(options.prune, level.pruned_components));
            }
            int64_t most_vertices, most_faces;
            limits_of(targets[i], in, most_vertices, most_faces);
            if (within) DM_TRY(decimator.run(most_vertices, most_faces));
            decimator.guard = nullptr;
        }
        level.stopped_by = within ? decimator.stopped_by : DELMESH_STOPPED_BY_BOUND;
        if (bounded && within) {
            // That the bound is spent is what was asked for.
            if (level.stopped_by == DELMESH_STOPPED_BY_BOUND) level.stopped_by = DELMESH_STOPPED_BY_TARGET;
            level.bound = targets[i].value;
        }
        Mesh& mesh = *out[i];
        const double collapsing = watch.lap();
        report.seconds_decimate += collapsing;
        DM_TRY(maker.make(mesh, i > 0 ? out[i - 1] : nullptr));
        double exporting = watch.lap(), relaxing = 0;
        if (options.quality > 0 && targets[i].kind != DELMESH_TARGET_FULL) {
            maker.find_staying(stays);
            if (i + 1 == count) // relaxation needs much itself
                decimator.finish();
            else
                decimator.rest();
            const Context::Part part(context, middle, middle + 0.8 * (to - middle));
            const RelaxRules how{.precision = rules.precision,
                                 .boundary_rule = rules.boundary_rule,
                                 .fold_cosine = rules.fold_cosine,
                                 .sweeps = options.quality,
                                 .kept_bits = surface.kept_bits};
            if (bounded && within)
                DM_TRY(relax_within(context, in, how, level.bound, stays.data(), mesh, level.relaxed_vertices));
            else
                DM_TRY(relax(context, in, how, stays.data(), mesh, level.relaxed_vertices));
            relaxing = watch.lap();
            report.seconds_relax += relaxing;
        }
        DM_TRY(context.stage("export", middle + 0.8 * (to - middle), to));
        DM_TRY(maker.map_to_source(mesh));
        if (options.map != 0) {
            LevelTraces traces(context.memory());
            maker.trace(mesh, traces);
            if (!corner_maps) {
                corner_maps.emplace(context, in, full, surface.kept_bits);
                DM_TRY(corner_maps->begin());
            }
            DM_TRY(corner_maps->map(traces, mesh));
            if (options.quality > 0) corner_maps.reset(); // the memory is for relaxation
            DM_TRY(name_places(context, in, mesh));
        }
        DM_TRY(certify(i));
        thaw(mesh);
        if (bounded && !within) DM_TRY(bound_distance(context, in, mesh, level.bound));
        exporting += watch.lap();
        report.seconds_export += exporting;
        level.seconds = collapsing + relaxing + exporting;
    }
    if (is_level) {
        thaw(full);
        if (options.map == 0) full.drop_map();
        DM_TRY(name_places(context, in, full));
    }
    report.collapses = decimator.counts.collapses;
    report.flips = decimator.counts.flips;
    report.undone = decimator.counts.undone;
    return DELMESH_OK;
}

} // namespace dm
