// SPDX-License-Identifier: Apache-2.0
#include "shim_measure.h"

#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <utility>

#include "algo/measure.h"
#include "geom/bvh.h"
#include "geom/closest_point.h"

using dm::Vec3;

namespace {

// A context that does to a call what the run asks for.
class Host {
public:
    explicit Host(shim_run& run) : run_(run), context_(options(run, this), memory(options(run, this))) {
        run_.progress_calls = run_.loops = run_.leaked_bytes = 0;
        run_.last_fraction = 0;
        run_.progress_went_back = 0;
        before_ = context_.memory().current();
        context_.begin_call();
    }
    template <class Call>
    int32_t call(Call&& body) {
        int32_t status;
        try {
            status = body(context_);
        } catch (const dm::AllocationFailure& failure) {
            status = failure.status;
        }
        status = context_.end_call(status);
        std::snprintf(run_.error, sizeof run_.error, "%s", context_.error_text());
        run_.leaked_bytes = static_cast<int64_t>(context_.memory().current() - before_);
        return status;
    }

private:
    static delmesh_context_options options(const shim_run& run, Host* self) {
        delmesh_context_options o{};
        o.struct_size = sizeof o;
        o.max_threads = run.threads == 0 ? 2 : run.threads;
        o.allocation_limit = run.allocation_limit;
        o.user = self;
        o.progress = [](void* user, double fraction, const char*) -> int32_t {
            shim_run& r = static_cast<Host*>(user)->run_;
            if (fraction < r.last_fraction) r.progress_went_back = 1;
            r.last_fraction = fraction;
            return ++r.progress_calls == r.cancel_at_progress ? 0 : DELMESH_CONTINUE;
        };
        if (run.threads == 0) {
            o.parallel_for = [](void* user, int32_t count, delmesh_task_fn task, void* data) {
                Host& host = *static_cast<Host*>(user);
                const bool cancel = ++host.run_.loops == host.run_.cancel_at_loop;
                for (int32_t i = count - 1; i >= 0; --i) {
                    if (cancel && i == count / 2) host.context_.request_cancel();
                    task(data, i);
                }
            };
        }
        return o;
    }
    static dm::Memory* memory(const delmesh_context_options& o) { return dm::Memory::create(o); }

    shim_run& run_;
    dm::Context context_;
    uint64_t before_ = 0;
};

// The test's arrays as a Mesh, in memory without limits.
class TestMesh {
public:
    explicit TestMesh(const shim_mesh& from) : memory_(dm::Memory::create({})), mesh(*memory_) {
        mesh.vertex_count = from.vertices;
        mesh.precision = from.f32 != 0 ? dm::Precision::f32 : dm::Precision::f64;
        for (int32_t i = 0; i < 3 * from.vertices; ++i) {
            if (from.f32 != 0) mesh.pos32.push_back(static_cast<float>(from.positions[i]));
            else mesh.pos64.push_back(from.positions[i]);
        }
        std::map<std::pair<int32_t, int32_t>, int32_t> open;
        for (int32_t c = 0; c < 3 * from.faces; ++c) {
            mesh.corner_vert.push_back(from.corners[c]);
            mesh.corner_twin.push_back(dm::kBoundary);
        }
        for (int32_t c = 0; c < 3 * from.faces; ++c) {
            const int32_t p = from.corners[c], q = from.corners[dm::next_corner(c)];
            const auto other = open.find({q, p});
            if (other == open.end()) {
                open[{p, q}] = c;
            } else {
                mesh.corner_twin[c] = other->second;
                mesh.corner_twin[other->second] = c;
                open.erase(other);
            }
        }
    }

private:
    struct Release {
        void operator()(dm::Memory* memory) const { memory->release(); }
    };
    std::unique_ptr<dm::Memory, Release> memory_;

public:
    dm::Mesh mesh;
};

} // namespace

int32_t shim_measure_quality(const shim_mesh* mesh, shim_run* run, delmesh_quality_report* report) {
    const TestMesh m(*mesh);
    *report = {};
    Host host(*run);
    return host.call([&](dm::Context& context) { return dm::measure_quality(context, m.mesh, *report); });
}

int32_t shim_measure_distance(const shim_mesh* a, const shim_mesh* b, const delmesh_distance_options* options, shim_run* run,
                              delmesh_distance_report* report) {
    const TestMesh first(*a), second(*b);
    *report = {};
    Host host(*run);
    return host.call(
        [&](dm::Context& context) { return dm::measure_distance(context, first.mesh, second.mesh, *options, *report); });
}

int32_t shim_closest_mismatches(const shim_mesh* mesh, const double* points, int32_t count) {
    const TestMesh m(*mesh);
    shim_run run{};
    run.threads = 1;
    Host host(run);
    int32_t mismatches = 0;
    const int32_t status = host.call([&](dm::Context& context) {
        dm::Bvh bvh(context.memory());
        const dm::Frame frame(dm::used_box(m.mesh));
        DM_TRY(bvh.build(context, m.mesh, frame));
        for (int32_t i = 0; i < count; ++i) {
            const Vec3 p = frame({points[3 * i], points[3 * i + 1], points[3 * i + 2]});
            double best = HUGE_VAL;
            for (int32_t t = 0; t < bvh.size(); ++t) best = std::fmin(best, bvh.distance_squared(p, t));
            const dm::Bvh::Hit hit = bvh.closest(p, i % bvh.size());
            mismatches += hit.distance_squared != best || bvh.distance_squared(p, hit.triangle) != best;
        }
        return static_cast<dm::Status>(DELMESH_OK);
    });
    return status == DELMESH_OK ? mismatches : -1;
}

double shim_triangle_distance(const double* p, const double* t) {
    const Vec3 a{t[0], t[1], t[2]}, b{t[3], t[4], t[5]}, c{t[6], t[7], t[8]};
    return std::sqrt(dm::triangle_distance_squared({p[0], p[1], p[2]}, a, b, c));
}
