// SPDX-License-Identifier: Apache-2.0
// Least squares over points spread evenly over the mesh's faces. With the mass matrix M of linear functions on these faces, the
// change x of what interpolation at the vertices gave solves M x = b, b being what it left at those points. All of M's diagonally
// scaled eigenvalues are between 1/2 and 2 (Wathen, Realistic Eigenvalue Bounds for the Galerkin Mass Matrix, 1987), and at most 3
// where points were left out: some steps of Richardson's iteration are enough, each vertex on its own.
#include "algo/fit.h"

#include <algorithm>
#include <cmath>

#include "algo/parallel_slices.h"
#include "algo/surface_map.h"
#include "algo/transfer.h"
#include "geom/closest_point.h"
#include "mesh/source_map.h"
#include "mesh/views.h"

namespace dm {
namespace {

constexpr int64_t kFaces = 64, kVertices = 1024; // per block
constexpr int kSteps = 24;                       // 0.7^24 = 2e-4 of the change that is left at most
constexpr double kStep = 0.6;                    // below 2/3 none diverges
constexpr int kMostComponents = 256;

template <class T>
class Fit {
public:
    Fit(Context& context, const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
        const delmesh_view_mut& target)
        : context_(context), in_(in), mesh_(mesh), by_corner_(domain == DELMESH_DOMAIN_CORNER),
          direction_(policy == DELMESH_TRANSFER_DIRECTION), components_(source.components), source_(source), target_(target),
          sheets_(context.memory(), in, kEdgeGiven), first_(context.memory()), own_(context.memory()), free_(context.memory()),
          mass_(context.memory()), rest_(context.memory()), change_(context.memory()), next_(context.memory()) {}

    Status run() {
        DM_TRY(sheets_.begin(context_));
        DM_TRY(find_first_corners(context_, mesh_, first_));
        DM_TRY(find_own_corners());
        DM_TRY(find_free_vertices());
        DM_TRY(sample());
        DM_TRY(solve());
        return write();
    }

private:
    // ---- Indices

    int32_t source_index(int32_t c) const { // of the source's corner c, in the caller's numbers
        if (by_corner_) return in_.imported ? source_of(in_.corner_map, c) : c;
        const int32_t v = in_.corner_vert[c];
        return in_.imported ? source_of(in_.vert_source, v) : v;
    }
    T* at(int32_t c) const { return element<T>(target_, by_corner_ ? c : mesh_.corner_vert[c]); }

    // From the caller's corners to the source's own.
    Status find_own_corners() {
        if (!in_.imported || in_.corner_map.empty()) return DELMESH_OK;
        DM_TRY(fill(context_, own_, mesh_.source_corners, -1));
        for (int32_t c = 0; c < in_.corners(); ++c) own_[in_.corner_map[c]] = c;
        return DELMESH_OK;
    }
    // A face of the source at the place of the corner c, on its side of all borders.
    int32_t face_at(int32_t c) const {
        const CornerPlace place = corner_place(mesh_, c);
        const int k = static_cast<int>(std::max_element(place.weight, place.weight + 3) - place.weight);
        const int32_t corner = own_.empty() ? place.corner[k] : own_[place.corner[k]];
        return corner < 0 ? -1 : face_of(corner);
    }
    // body(c) for the corners around a vertex.
    template <class Body>
    void around(int32_t v, Body&& body) const {
        const int32_t start = first_[v];
        if (start < 0) return;
        int32_t c = start;
        do {
            body(c);
            c = mesh_.corner_twin[prev_corner(c)];
        } while (c >= 0 && c != start);
    }

    // ---- Which values may change: not those on either side of a border, which have to stay where the other side's are, and not
    // those on the boundary, inside of which all that is known lies.

    Status find_free_vertices() {
        free_.resize_uninitialized(mesh_.vertices());
        return context_.parallel(mesh_.vertices(), kVertices, [&](int64_t, int64_t begin, int64_t end) {
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
                bool is_free = first_[v] >= 0;
                around(v, [&](int32_t c) {
                    is_free &= mesh_.corner_twin[c] >= 0 && mesh_.corner_twin[prev_corner(c)] >= 0;
                    for (int32_t i = 0; i < components_; ++i) is_free &= at(c)[i] == at(first_[v])[i]; // no NaN
                });
                free_[v] = is_free ? 1 : 0;
            }
        });
    }

    // ---- The points

    Status sample() {
        const double per_face = static_cast<double>(in_.faces()) / std::max(1, mesh_.faces());
        const int side = std::clamp(static_cast<int>(std::ceil(std::sqrt(2 * per_face))), 3, 16);
        DM_TRY(fill(context_, mass_, int64_t{mesh_.faces()}, Mass{{0, 0, 0, 0, 0, 0}}));
        DM_TRY(fill(context_, rest_, int64_t{mesh_.corners()} * components_, 0.0));
        return parallel_slices(context_, mesh_.faces(), kFaces, 0.2, 0.8, [&](int64_t, int64_t begin, int64_t end) {
            for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) sample_face(f, side);
        });
    }

    // The middles of the side x side triangles that the face is cut into.
    void sample_face(int32_t f, int side) {
        bool any = false;
        for (int k = 0; k < 3; ++k) any |= free_[mesh_.corner_vert[3 * f + k]] != 0;
        if (!any) return;
        Points points{{mesh_.position(mesh_.corner_vert[3 * f]), mesh_.position(mesh_.corner_vert[3 * f + 1]),
                       mesh_.position(mesh_.corner_vert[3 * f + 2])},
                      {face_at(3 * f), face_at(3 * f + 1), face_at(3 * f + 2)},
                      -1};
        const double area = length(cross(points.at[1] - points.at[0], points.at[2] - points.at[0])) / (side * side);
        for (int row = 0; row < side; ++row)
            for (int i = 0; i < 2 * (side - row) - 1; ++i) {
                const bool down = i % 2 == 1;
                const double u = (row + (down ? 2.0 : 1.0) / 3) / side, v = (i / 2 + (down ? 2.0 : 1.0) / 3) / side;
                add_point(f, points, {1 - u - v, u, v}, area);
            }
    }
    struct Points { // of one face
        Vec3 at[3];
        int32_t starts[3]; // faces of the source
        int32_t last;      // where the last point was found
    };
    void add_point(int32_t f, Points& points, const double (&w)[3], double area) {
        const Vec3 x = w[0] * points.at[0] + w[1] * points.at[1] + w[2] * points.at[2];
        Sheets::Place place;
        const int32_t start = points.starts[std::max_element(w, w + 3) - w];
        const int32_t near = points.last >= 0 ? points.last : start;
        if (near >= 0 && !walk(x, near, place)) {
            place = Sheets::Place();
            sheets_.descend(x, near, place);
            if (start >= 0 && start != near) sheets_.descend(x, start, place);
        }
        if (place.face < 0) return;
        points.last = place.face;
        for (int32_t k = 0; k < 3; ++k) // beyond the border there is nothing to compare with
            if (place.weight[k] == 0 && sheets_.is_border(next_corner(3 * place.face + k))) return;
        double here[kMostComponents], there[kMostComponents];
        interpolate(
            w, [&](int k) { return at(3 * f + k); }, here);
        interpolate(
            place.weight, [&](int k) { return element<T>(source_, source_index(3 * place.face + k)); }, there);
        for (int32_t i = 0; i < components_; ++i)
            if (!std::isfinite(here[i]) || !std::isfinite(there[i])) return;
        Mass& mass = mass_[f];
        for (int k = 0, n = 0; k < 3; ++k) {
            for (int l = k; l < 3; ++l) mass.entry[n++] += area * w[k] * w[l];
            double* const rest = rest_.data() + (3 * static_cast<int64_t>(f) + k) * components_;
            for (int32_t i = 0; i < components_; ++i) rest[i] += area * w[k] * (there[i] - here[i]);
        }
    }
    // From face to face across the edges where the closest point is: from the point before it is not far. False where that does not
    // end, or comes to a vertex.
    bool walk(const Vec3& x, int32_t face, Sheets::Place& place) const {
        for (int32_t steps = 0, last = -1; steps < 8; ++steps) {
            const ClosestPoint point =
                closest_on_triangle(x, in_.position(in_.corner_vert[3 * face]), in_.position(in_.corner_vert[3 * face + 1]),
                                    in_.position(in_.corner_vert[3 * face + 2]));
            place = {length_squared(point.residual), face, {point.weight[0], point.weight[1], point.weight[2]}};
            if (point.inside) return true;
            int32_t across = -1;
            for (int32_t k = 0; k < 3; ++k) {
                if (point.weight[k] != 0) continue;
                if (across >= 0) return false;
                across = next_corner(3 * face + k);
            }
            if (across < 0) return false;
            if (sheets_.is_border(across) || face_of(in_.corner_twin[across]) == last) return true;
            last = face;
            face = face_of(in_.corner_twin[across]);
        }
        return false;
    }
    template <class Values>
    void interpolate(const double* weight, Values&& values, double* out) const {
        std::fill_n(out, components_, 0.0);
        for (int k = 0; k < 3; ++k) {
            if (weight[k] == 0) continue;
            const T* const from = values(k);
            for (int32_t i = 0; i < components_; ++i) out[i] += weight[k] * static_cast<double>(from[i]);
        }
        if (direction_) make_unit(out);
    }
    void make_unit(double* values) const {
        double squares = 0;
        for (int32_t i = 0; i < components_; ++i) squares += values[i] * values[i];
        if (!(squares > 0) || !std::isfinite(squares)) return;
        for (int32_t i = 0; i < components_; ++i) values[i] /= std::sqrt(squares);
    }

    // ---- The change

    Status solve() {
        const int64_t numbers = int64_t{mesh_.vertices()} * components_;
        DM_TRY(fill(context_, change_, numbers, 0.0));
        DM_TRY(fill(context_, next_, numbers, 0.0));
        for (int step = 0; step < kSteps; ++step) {
            DM_TRY(context_.progress(0.8 + 0.2 * step / kSteps));
            DM_TRY(context_.parallel(mesh_.vertices(), kVertices, [&](int64_t, int64_t begin, int64_t end) {
                for (int32_t v = static_cast<int32_t>(begin); v < end; ++v)
                    if (free_[v] != 0) improve(v);
            }));
            std::swap(change_, next_);
        }
        return DELMESH_OK;
    }
    double* change_of(Array<double>& changes, int32_t v) { return changes.data() + int64_t{v} * components_; }
    void improve(int32_t v) {
        static constexpr int kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        double rest[kMostComponents] = {}, diagonal = 0;
        around(v, [&](int32_t c) {
            const int32_t f = face_of(c), k = c - 3 * f;
            diagonal += mass_[f].entry[kEntry[k][k]];
            const double* const given = rest_.data() + int64_t{c} * components_;
            for (int32_t i = 0; i < components_; ++i) rest[i] += given[i];
            for (int l = 0; l < 3; ++l) {
                const double* const x = change_of(change_, mesh_.corner_vert[3 * f + l]); // 0 where nothing may change
                const double m = mass_[f].entry[kEntry[k][l]];
                for (int32_t i = 0; i < components_; ++i) rest[i] -= m * x[i];
            }
        });
        if (!(diagonal > 0)) return;
        const double* const was = change_of(change_, v);
        double* const now = change_of(next_, v);
        for (int32_t i = 0; i < components_; ++i) now[i] = was[i] + kStep * rest[i] / diagonal;
    }

    // Nothing leaves the range that the layer has: a texture's coordinates stay on it, colours stay colours.
    Status write() {
        double low[kMostComponents], high[kMostComponents];
        std::fill_n(low, components_, HUGE_VAL);
        std::fill_n(high, components_, -HUGE_VAL);
        for (int64_t n = 0; n < source_.count; ++n) {
            const T* const values = element<T>(source_, n);
            for (int32_t i = 0; i < components_; ++i) {
                if (!std::isfinite(static_cast<double>(values[i]))) continue;
                low[i] = std::min(low[i], static_cast<double>(values[i]));
                high[i] = std::max(high[i], static_cast<double>(values[i]));
            }
        }
        return context_.parallel(mesh_.vertices(), kVertices, [&](int64_t, int64_t begin, int64_t end) {
            double values[kMostComponents];
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
                if (free_[v] == 0) continue;
                const T* const mapped = at(first_[v]);
                const double* const change = change_of(change_, v);
                bool same = true;
                for (int32_t i = 0; i < components_; ++i) {
                    const double was = static_cast<double>(mapped[i]);
                    values[i] = direction_ ? was + change[i] : std::clamp(was + change[i], low[i], high[i]);
                    same &= values[i] == was;
                }
                if (same) continue;
                if (direction_) make_unit(values);
                around(v, [&](int32_t c) {
                    T* const to = at(c);
                    for (int32_t i = 0; i < components_; ++i)
                        to[i] = static_cast<T>(std::is_integral_v<T> ? std::nearbyint(values[i]) : values[i]);
                });
            }
        });
    }

    struct Mass {
        double entry[6]; // 00 01 02 11 12 22
    };

    Context& context_;
    const Mesh &in_, &mesh_;
    const bool by_corner_, direction_;
    const int32_t components_;
    const delmesh_view source_;
    const delmesh_view_mut target_;
    Sheets sheets_;
    Array<int32_t> first_;        // per vertex of the mesh, a corner
    Array<int32_t> own_;          // per corner of the caller; empty: the same
    Array<uint8_t> free_;         // per vertex
    Array<Mass> mass_;            // per face
    Array<double> rest_;          // per corner and component
    Array<double> change_, next_; // per vertex and component
};

} // namespace

Status transfer_fitted(Context& context, const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy,
                       const delmesh_view& source, const delmesh_view_mut& target) {
    {
        const Context::Part part(context, 0, 0.2);
        DM_TRY(transfer(context, mesh, domain, policy, source, target));
    }
    DM_TRY(context.stage("fit", 0.2, 1));
    switch (source.type) {
    case DELMESH_FLOAT32:
        return Fit<float>(context, in, mesh, domain, policy, source, target).run();
    case DELMESH_FLOAT64:
        return Fit<double>(context, in, mesh, domain, policy, source, target).run();
    case DELMESH_INT32:
        return Fit<int32_t>(context, in, mesh, domain, policy, source, target).run();
    case DELMESH_UINT32:
        return Fit<uint32_t>(context, in, mesh, domain, policy, source, target).run();
    case DELMESH_INT64:
        return Fit<int64_t>(context, in, mesh, domain, policy, source, target).run();
    default:
        return Fit<uint8_t>(context, in, mesh, domain, policy, source, target).run();
    }
}

} // namespace dm
