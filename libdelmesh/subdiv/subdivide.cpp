// SPDX-License-Identifier: Apache-2.0
// Every face of the cage is cut by the pattern of its size. Points on vertices and edges of the cage have their numbers from these,
// and are evaluated on the first face that has them: faces share vertices because they share an edge, not because points are close.
#include "subdiv/subdivide.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/borders.h"
#include "mesh/connect.h"
#include "mesh/source_map.h"
#include "subdiv/faces.h"
#include "subdiv/limit_distance.h"
#include "subdiv/limit_values.h"

namespace dm {
namespace {

using LL = long long; // for %lld

constexpr int32_t kHighestRate = 4096;

// ---- Facets -----------------------------------------------------------------------------------------------------------------

// A triangle or quad on its way into the mesh. bits[k]: of the edge from corner k on.
struct Facet {
    int32_t source, sides; // source: the cage's face
    int32_t vert[4], place[4];
    EdgeBits bits[4];
};

void write_triangle(Mesh& mesh, int64_t face, const Facet& facet, int i, int j, int k) {
    const int from[3] = {i, j, k}, to[3] = {j, k, i};
    for (int n = 0; n < 3; ++n) {
        const int64_t c = 3 * face + n;
        const bool side = to[n] == (from[n] + 1) % facet.sides;
        mesh.corner_vert[c] = facet.vert[from[n]];
        mesh.corner_cage[c] = facet.place[from[n]];
        mesh.corner_bits[c] = side ? facet.bits[from[n]] : EdgeBits{0};
    }
    mesh.face_source[face] = facet.source;
}

// Quads are cut along the shorter diagonal of the rounded positions. Returns the number of triangles.
int64_t write_facet(Mesh& mesh, int64_t face, const Facet& facet) {
    if (facet.sides == 3) {
        write_triangle(mesh, face, facet, 0, 1, 2);
        return 1;
    }
    const auto distance = [&](int i, int j) {
        return length_squared(mesh.position(facet.vert[i]) - mesh.position(facet.vert[j]));
    };
    if (distance(0, 2) <= distance(1, 3)) {
        write_triangle(mesh, face, facet, 0, 1, 2);
        write_triangle(mesh, face + 1, facet, 0, 2, 3);
    } else {
        write_triangle(mesh, face, facet, 0, 1, 3);
        write_triangle(mesh, face + 1, facet, 1, 2, 3);
    }
    return 2;
}

// ---- Patterns ---------------------------------------------------------------------------------------------------------------

// Those of all sizes of faces that the cage has.
class Patterns {
public:
    explicit Patterns(Memory& memory) : at_(memory), places_(memory), facets_(memory) {}

    struct Pattern {
        const float* places;   // 2 per point
        const int32_t* facets; // 4 per facet
        int32_t points, facet_count, triangles;
    };

    Status cut(Context& context, const Cage& cage, int32_t rate) {
        FacePattern pattern(context.memory());
        for (int32_t f = 0; f < cage.faces(); ++f) {
            const int32_t size = cage.face_size(f);
            if (size >= at_.size()) at_.resize(size + 1, At{-1, -1, 0, 0, 0});
            if (cage.has_limit[f] == 0 || at_[size].place >= 0) continue;
            DM_TRY(context.progress(0));
            cage.limit.cut(size, rate, pattern);
            At& at = at_[size];
            at.place = places_.size();
            at.facet = facets_.size();
            at.points = static_cast<int32_t>(pattern.places.size() / 2);
            at.facet_count = static_cast<int32_t>(pattern.facets.size() / 4);
            for (const float x : pattern.places) places_.push_back(x);
            for (const int32_t i : pattern.facets) facets_.push_back(i);
            for (int64_t i = 3; i < pattern.facets.size(); i += 4) at.triangles += pattern.facets[i] < 0 ? 1 : 2;
        }
        return DELMESH_OK;
    }
    Pattern of(int32_t size) const {
        const At& at = at_[size];
        return {places_.data() + at.place, facets_.data() + at.facet, at.points, at.facet_count, at.triangles};
    }

private:
    struct At {
        int64_t place, facet; // -1: no face of that size has a limit
        int32_t points, facet_count, triangles;
    };
    Array<At> at_; // by size
    Array<float> places_;
    Array<int32_t> facets_;
};

// ---- Rates ------------------------------------------------------------------------------------------------------------------

class Fineness {
public:
    Fineness(Context& context, const Cage& cage) : context_(context), cage_(cage), faces_of_size_(context.memory()) {
        for (int32_t f = 0; f < cage.faces(); ++f) {
            if (cage.has_limit[f] == 0) continue;
            const int32_t size = cage.face_size(f);
            if (size >= faces_of_size_.size()) faces_of_size_.resize(size + 1, 0);
            ++faces_of_size_[size];
        }
    }

    Status choose(const delmesh_subdivide_options& options, delmesh_subdivide_report& report) {
        switch (options.fineness) {
        case DELMESH_FINENESS_EDGE_LENGTH: {
            DM_TRY(find_longest_edge(report.longest_edge));
            const double rate = std::ceil(report.longest_edge / options.value);
            if (!(rate <= kHighestRate))
                return context_.fail(DELMESH_ERROR_TOO_LARGE,
                                     "The longest edge would be cut into more than %d pieces of the edge length 'value'.",
                                     kHighestRate);
            report.rate = std::max(1, static_cast<int32_t>(rate));
            break;
        }
        case DELMESH_FINENESS_FACES: {
            int32_t fits = 1, too_fine = kHighestRate + 1;
            while (too_fine - fits > 1) {
                const int32_t middle = fits + (too_fine - fits) / 2;
                (static_cast<double>(triangles(middle)) <= options.value ? fits : too_fine) = middle;
            }
            report.rate = fits;
            break;
        }
        default:
            report.rate = static_cast<int32_t>(options.value);
        }
        if (triangles(report.rate) > INT32_MAX / 3)
            return context_.fail(DELMESH_ERROR_TOO_LARGE, "The rate %d made %lld triangles, more than 2^31 - 1 corners.",
                                 report.rate, LL{triangles(report.rate)});
        return DELMESH_OK;
    }

private:
    int64_t triangles(int32_t rate) const {
        int64_t sum = 0;
        for (int32_t size = 3; size < faces_of_size_.size(); ++size)
            if (faces_of_size_[size] != 0) sum += faces_of_size_[size] * cage_.limit.count(size, rate).triangles;
        return sum;
    }

    // Of the cage's edges on the limit surface, each as a line of kPieces.
    Status find_longest_edge(double& longest) {
        constexpr int32_t kPieces = 8;
        Patterns patterns(context_.memory());
        DM_TRY(patterns.cut(context_, cage_, kPieces));
        Array<double> found(context_.memory(), cage_.faces(), 0);
        DM_TRY(for_limit_faces(context_, cage_, 4 * kPieces, 0, 0.1, [&](LimitEvaluator& evaluator, int32_t f) {
            const float* const places = patterns.of(cage_.face_size(f)).places;
            const int32_t points = cage_.face_size(f) * kPieces;
            evaluator.face(f, -1);
            evaluator.take(cage_.positions.data(), 3);
            const auto at = [&](int32_t i) {
                double x[3];
                evaluator.at(places[2 * (i % points)], places[2 * (i % points) + 1], x);
                return Vec3{x[0], x[1], x[2]};
            };
            Vec3 before = at(0);
            for (int32_t i = 0; i < points; i += kPieces) {
                double length_of_edge = 0;
                for (int32_t k = i + 1; k <= i + kPieces; ++k) {
                    const Vec3 here = at(k);
                    length_of_edge += length(here - before);
                    before = here;
                }
                found.data()[f] = std::max(found.data()[f], length_of_edge);
            }
        }));
        longest = *std::max_element(found.begin(), found.end());
        return DELMESH_OK;
    }

    Context& context_;
    const Cage& cage_;
    Array<int64_t> faces_of_size_;
};

// ---- Points -----------------------------------------------------------------------------------------------------------------

// Numbers of the points: those of the cage's faces one after the other, each with the vertices and edges that it is the first to
// have, and evaluates.
class Points {
public:
    Points(Context& context, const Cage& cage, const Patterns& patterns, int32_t rate)
        : cage_(cage), patterns_(patterns), rate_(rate), vert_point_(context.memory(), cage.vertices(), -1),
          edge_point_(context.memory(), cage.edges(), -1), face_point_(context.memory(), cage.faces(), -1),
          face_first_(context.memory(), cage.faces(), 0) {}

    struct Counts {
        int64_t points = 0, triangles = 0, places = 0;
    };
    struct First { // of a face's
        int32_t triangle, place;
    };
    Status number(Context& context, Array<First>& first_of, Counts& counts) {
        const auto take = [&](int32_t& first, int64_t count) {
            first = static_cast<int32_t>(counts.points);
            counts.points += count;
        };
        first_of.resize_uninitialized(cage_.faces());
        for (int32_t f = 0; f < cage_.faces(); ++f) {
            if (f % (1 << 16) == 0) DM_TRY(context.progress(0.1));
            first_of[f] = {static_cast<int32_t>(counts.triangles), static_cast<int32_t>(counts.places)};
            face_first_[f] = static_cast<int32_t>(counts.points);
            if (cage_.has_limit[f] == 0) continue;
            const Patterns::Pattern pattern = patterns_.of(cage_.face_size(f));
            for (int32_t c = cage_.face_first[f]; c < cage_.face_first[f + 1]; ++c) {
                if (vert_point_[cage_.corner_vert[c]] < 0) take(vert_point_[cage_.corner_vert[c]], 1);
                if (edge_point_[cage_.corner_edge[c]] < 0) take(edge_point_[cage_.corner_edge[c]], rate_ - 1);
            }
            take(face_point_[f], pattern.points - cage_.face_size(f) * rate_);
            counts.triangles += pattern.triangles;
            counts.places += pattern.points;
            if (counts.places > INT32_MAX)
                return context.fail(DELMESH_ERROR_TOO_LARGE, "The rate %d made more than 2147483647 vertices.", rate_);
        }
        return DELMESH_OK;
    }

    // The number of point i of the pattern of face f.
    int32_t operator()(int32_t f, int32_t i) const {
        const int32_t boundary = cage_.face_size(f) * rate_;
        if (i >= boundary) return face_point_[f] + (i - boundary);
        const int32_t c = cage_.face_first[f] + i / rate_, along = i % rate_;
        if (along == 0) return vert_point_[cage_.corner_vert[c]];
        const int32_t edge = cage_.corner_edge[c];
        const bool forward = cage_.edge_verts[2 * int64_t{edge}] == cage_.corner_vert[c];
        return edge_point_[edge] + (forward ? along - 1 : rate_ - 1 - along);
    }
    // Of a point of face f: is f the first to have it?
    bool is_first(int32_t f, int32_t number) const { return number >= face_first_[f]; }

    // The bits of the line from point i to point j of the pattern of face f.
    EdgeBits bits_of(int32_t f, int32_t i, int32_t j) const {
        const int32_t boundary = cage_.face_size(f) * rate_;
        if (i >= boundary || j >= boundary || j != (i + 1) % boundary) return 0;
        return cage_.edge_bits[cage_.corner_edge[cage_.face_first[f] + i / rate_]];
    }

private:
    const Cage& cage_;
    const Patterns& patterns_;
    const int32_t rate_;
    Array<int32_t> vert_point_, edge_point_, face_point_; // the first point inside of each
    Array<int32_t> face_first_;                           // the first point that each face is the first to have
};

// ---- Subdivision ------------------------------------------------------------------------------------------------------------

class Subdivision {
public:
    Subdivision(Context& context, const Cage& cage, const delmesh_subdivide_options& options, Mesh& mesh,
                delmesh_subdivide_report& report)
        : context_(context), cage_(cage), options_(options), mesh_(mesh), report_(report) {}

    Status run() {
        DM_TRY(context_.stage("subdivide", 0, 0.5));
        for (const uint8_t has : cage_.has_limit) report_.left_out_faces += has == 0;
        report_.unmatched_creases = cage_.unmatched_creases;
        if (report_.left_out_faces == cage_.faces())
            return context_.fail(DELMESH_ERROR_NO_SURFACE, "No face of the cage had a limit surface.");
        DM_TRY(Fineness(context_, cage_).choose(options_, report_));
        mesh_.precision = static_cast<Precision>(options_.precision);
        mesh_.cage = cage_.fingerprint;
        DM_TRY(options_.evaluation == DELMESH_EVALUATION_FAR ? refine() : evaluate());
        DM_TRY(context_.stage("connect", 0.5, 0.8));
        DM_TRY(connect());
        DM_TRY(context_.stage("layers", 0.8, 0.9));
        DM_TRY(keep_layers());
        if (options_.measure != 0) {
            DM_TRY(context_.stage("measure", 0.9, 1));
            DM_TRY(limit_distance(context_, cage_, mesh_, report_.limit_distance, report_.limit_rms));
        }
        report_.vertices = mesh_.vertices();
        report_.faces = mesh_.faces();
        return DELMESH_OK;
    }

private:
    void make_room(int64_t points, int64_t triangles, int64_t places) {
        mesh_.vertex_count = static_cast<int32_t>(points);
        if (mesh_.precision == Precision::f32)
            mesh_.pos32.resize_uninitialized(3 * points);
        else
            mesh_.pos64.resize_uninitialized(3 * points);
        mesh_.corner_vert.resize_uninitialized(3 * triangles);
        mesh_.corner_cage.resize_uninitialized(3 * triangles);
        mesh_.corner_bits.resize_uninitialized(3 * triangles);
        mesh_.face_source.resize_uninitialized(triangles);
        mesh_.cage_places.resize_uninitialized(places);
    }
    // False where it does not fit the precision.
    bool set_point(int32_t point, const double* x) {
        const Vec3 rounded = round_to(mesh_.precision, Vec3{x[0], x[1], x[2]});
        mesh_.set_position(point, rounded);
        return is_finite(rounded);
    }
    Status too_far(int64_t face) {
        return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                             "positions: the limit surface of face %lld left the range of the result's precision.", LL{face});
    }

    Status evaluate() {
        const int32_t rate = report_.rate;
        Patterns patterns(context_.memory());
        DM_TRY(patterns.cut(context_, cage_, rate));
        Points number(context_, cage_, patterns, rate);
        Points::Counts counts;
        Array<Points::First> first(context_.memory());
        DM_TRY(number.number(context_, first, counts));
        make_room(counts.points, counts.triangles, counts.places);
        Array<uint8_t> lost(context_.memory(), cage_.faces(), 0);
        const int64_t samples = counts.points / cage_.faces();
        DM_TRY(for_limit_faces(context_, cage_, samples, 0.1, 0.7, [&](LimitEvaluator& evaluator, int32_t f) {
            const Patterns::Pattern pattern = patterns.of(cage_.face_size(f));
            evaluator.face(f, -1);
            evaluator.take(cage_.positions.data(), 3);
            CagePlace* const places = mesh_.cage_places.data() + first[f].place;
            for (int32_t i = 0; i < pattern.points; ++i) {
                const int32_t point = number(f, i);
                places[i] = {f, pattern.places[2 * i], pattern.places[2 * i + 1]};
                if (!number.is_first(f, point)) continue;
                double x[3];
                evaluator.at(pattern.places[2 * i], pattern.places[2 * i + 1], x);
                if (!set_point(point, x)) lost.data()[f] = 1;
            }
        }));
        for (int32_t f = 0; f < cage_.faces(); ++f)
            if (lost[f] != 0) return too_far(f);
        const int64_t grain = 1 + 4096 / (samples + 1);
        return context_.parallel(cage_.faces(), grain, [&](int64_t, int64_t begin, int64_t end) {
            for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) {
                if (cage_.has_limit[f] == 0) continue;
                const Patterns::Pattern pattern = patterns.of(cage_.face_size(f));
                int64_t at = first[f].triangle;
                for (int32_t k = 0; k < pattern.facet_count; ++k) {
                    const int32_t* const of = pattern.facets + 4 * int64_t{k};
                    Facet facet;
                    facet.source = f;
                    facet.sides = of[3] < 0 ? 3 : 4;
                    for (int32_t n = 0; n < facet.sides; ++n) {
                        facet.vert[n] = number(f, of[n]);
                        facet.place[n] = first[f].place + of[n];
                        facet.bits[n] = number.bits_of(f, of[n], of[(n + 1) % facet.sides]);
                    }
                    at += write_facet(mesh_, at, facet);
                }
            }
        });
    }

    // OpenSubdiv's uniform refinement; vertices in the order in which faces use them.
    Status refine() {
        int32_t levels = 0;
        while (1 << levels < report_.rate) ++levels;
        if (report_.rate < 2 || 1 << levels != report_.rate)
            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                 "The rate was %d, and DELMESH_EVALUATION_FAR takes powers of two from 2 on.", report_.rate);
        RefinedCage refined(context_.memory());
        DM_TRY(refine_cage(context_, cage_, levels, refined));
        const int32_t sides = refined.face_size;
        const int64_t faces = refined.face_source.size();
        Array<int32_t> number(context_.memory(), refined.positions.size() / 3, -1);
        int32_t points = 0;
        for (int32_t& v : refined.face_verts) {
            if (number[v] < 0) number[v] = points++;
            v = number[v];
        }
        make_room(points, sides == 3 ? faces : 2 * faces, sides * faces);
        for (int64_t v = 0; v < number.size(); ++v)
            if (number[v] >= 0 && !set_point(number[v], refined.positions.data() + 3 * v)) return too_far(-1);
        int64_t at = 0;
        for (int64_t f = 0; f < faces; ++f) {
            if (f % (1 << 16) == 0) DM_TRY(context_.progress(0.8));
            Facet facet;
            facet.source = refined.face_source[f];
            facet.sides = sides;
            for (int32_t n = 0; n < sides; ++n) {
                const int64_t c = sides * f + n;
                const int32_t edge = refined.corner_edge[c];
                facet.vert[n] = refined.face_verts[c];
                facet.place[n] = static_cast<int32_t>(c);
                mesh_.cage_places[c] = {facet.source, refined.places[2 * c], refined.places[2 * c + 1]};
                facet.bits[n] = edge < 0 ? EdgeBits{0} : cage_.edge_bits[edge];
            }
            at += write_facet(mesh_, at, facet);
        }
        return DELMESH_OK;
    }

    Status connect() {
        Glance glance(context_.memory());
        DM_TRY(connect_faces(context_, false, 0, 0.7, mesh_, glance));
        DM_TRY(follow_repairs());
        mesh_.first_split = mesh_.vertices();
        mesh_.source_faces = cage_.faces();
        mesh_.counts.polygons = cage_.faces();
        if (std::all_of(mesh_.corner_bits.begin(), mesh_.corner_bits.end(), [](EdgeBits bits) { return bits == 0; }))
            mesh_.corner_bits.free_storage();
        return count_mesh(context_, mesh_, &glance);
    }

    // Where faces were turned over or left out, corner_map tells the corners as they were written.
    Status follow_repairs() {
        if (mesh_.corner_map.empty()) return DELMESH_OK;
        const Array<int32_t> places = std::move(mesh_.corner_cage);
        const Array<EdgeBits> bits = std::move(mesh_.corner_bits);
        mesh_.corner_cage = Array<int32_t>(context_.memory());
        mesh_.corner_bits = Array<EdgeBits>(context_.memory());
        mesh_.corner_cage.resize_uninitialized(mesh_.corners());
        mesh_.corner_bits.resize_uninitialized(mesh_.corners());
        for (int32_t c = 0; c < mesh_.corners(); ++c) {
            const int32_t here = mesh_.corner_map[c], next = mesh_.corner_map[next_corner(c)];
            mesh_.corner_cage[c] = places[here];
            mesh_.corner_bits[c] = bits[next_corner(here) == next ? here : next];
        }
        mesh_.corner_map.free_storage();
        return context_.progress(0.8);
    }

    // As mesh_create keeps them: what operations want to know of the cage's layers.
    Status keep_layers() {
        for (int64_t i = 0; i < cage_.layers.size(); ++i) {
            const CageLayer& of = cage_.layers[i];
            MeshLayer layer{of.given.kind,
                            of.components,
                            of.given.border == DELMESH_BORDER_KEEP,
                            of.given.affine_tolerance,
                            of.given.weight,
                            of.borders * report_.rate,
                            -1};
            if (of.channel >= 0 && (of.given.kind == DELMESH_LAYER_UV || of.given.weight > 0)) {
                layer.first_value = mesh_.layer_values.size();
                const int64_t count = layer_value_count(mesh_);
                mesh_.layer_values.resize_uninitialized(layer.first_value + count * of.components);
                float* const values = mesh_.layer_values.data() + layer.first_value;
                const int64_t stride = of.components * static_cast<int64_t>(sizeof(float));
                DM_TRY(limit_at_places(context_, cage_, mesh_, static_cast<int32_t>(i),
                                       {values, count, stride, DELMESH_FLOAT32, of.components}));
                if (layer.affine_tolerance < 0) layer.affine_tolerance = default_affine_tolerance(values, count, of.components);
            }
            mesh_.layers.push_back(layer);
        }
        return DELMESH_OK;
    }

    Context& context_;
    const Cage& cage_;
    const delmesh_subdivide_options& options_;
    Mesh& mesh_;
    delmesh_subdivide_report& report_;
};

} // namespace

Status subdivide(Context& context, const Cage& cage, const delmesh_subdivide_options& options, Mesh& out,
                 delmesh_subdivide_report& report) {
    return Subdivision(context, cage, options, out, report).run();
}

} // namespace dm
