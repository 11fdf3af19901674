// SPDX-License-Identifier: Apache-2.0
// One counting sort files the corners under their vertices; from there on each vertex is a matter of its own. An edge that arrives
// at a vertex leaves it again as its own twin, so the corners of one vertex tell the twins of all of them, and by following these,
// whether they form one fan.
#include "mesh/link_fans.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "mesh/slices.h"

namespace dm {
namespace {

constexpr int64_t kVertexGrain = 4096;

// All corners, sorted by vertex and, of one vertex, by number.
class CornersOfVertices {
public:
    explicit CornersOfVertices(Memory& memory) : ends_(memory), corners_(memory) {}

    // Slices of the faces are counted apart, so that each knows its places among the corners of a vertex: how many slices there
    // are changes nothing about the result.
    Status fill(Context& context, const Mesh& mesh) {
        const int64_t faces = mesh.faces(), vertices = mesh.vertices();
        const int64_t slices = few_slices(context, faces, vertices), slice = (faces + slices - 1) / slices;
        const int32_t* const vert = mesh.corner_vert.data();
        Array<int32_t> counts(context.memory(), slices * vertices);
        corners_.resize_uninitialized(mesh.corners());
        int32_t* const corners = corners_.data();
        DM_TRY(context.parallel(slices, 1, [&](int64_t k, int64_t, int64_t) {
            const int64_t begin = k * slice, end = std::min(faces, begin + slice);
            int32_t* const count = counts.data() + k * vertices;
            std::fill_n(count, vertices, 0);
            for (int64_t c = 3 * begin; c < 3 * end; ++c) ++count[vert[c]];
        }));
        DM_TRY(make_places(context, counts.data(), slices, vertices));
        if (slices > 1) { // a slice's corners may begin in the middle of a new huge page: two threads would clear it, or wait
            constexpr int64_t kPage = (1 << 21) / sizeof(int32_t);
            DM_TRY(context.parallel(corners_.size(), kPage, [&](int64_t, int64_t begin, int64_t) { corners[begin] = 0; }));
        }
        DM_TRY(context.parallel(slices, 1, [&](int64_t k, int64_t, int64_t) {
            const int64_t begin = k * slice, end = std::min(faces, begin + slice);
            int32_t* const next = counts.data() + k * vertices;
            for (int64_t c = 3 * begin; c < 3 * end; ++c) corners[next[vert[c]]++] = static_cast<int32_t>(c);
        }));
        if (slices > 1) std::copy_n(counts.data() + (slices - 1) * vertices, vertices, counts.data());
        ends_ = std::move(counts);
        return DELMESH_OK;
    }

    const int32_t* begin(int64_t v) const { return corners_.data() + (v == 0 ? 0 : ends_[v - 1]); }
    const int32_t* end(int64_t v) const { return corners_.data() + ends_[v]; }
    int32_t count(int64_t v) const { return static_cast<int32_t>(end(v) - begin(v)); }
    const int32_t* limit() const { return corners_.end(); }

private:
    // Numbers of corners, slice by slice, become the places where a slice's corners of a vertex begin, until they are all in.
    static Status make_places(Context& context, int32_t* counts, int64_t slices, int64_t vertices) {
        const auto sum_up = [&](int64_t begin, int64_t end, int32_t sum) {
            for (int64_t v = begin; v < end; ++v)
                for (int64_t k = 0; k < slices; ++k) sum += std::exchange(counts[k * vertices + v], sum);
        };
        if (slices == 1) return sum_up(0, vertices, 0), DELMESH_OK;
        constexpr int64_t kGrain = 1 << 15;
        Array<int32_t> before(context.memory(), (vertices + kGrain - 1) / kGrain);
        DM_TRY(context.parallel(vertices, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
            int32_t sum = 0;
            for (int64_t k = 0; k < slices; ++k)
                for (int64_t v = begin; v < end; ++v) sum += counts[k * vertices + v];
            before[block] = sum;
        }));
        int32_t sum = 0;
        for (int32_t& of_block : before) sum += std::exchange(of_block, sum);
        return context.parallel(vertices, kGrain,
                                [&](int64_t block, int64_t begin, int64_t end) { sum_up(begin, end, before[block]); });
    }

    Array<int32_t> ends_; // per vertex: one past its last corner
    Array<int32_t> corners_;
};

// Finds the corners of one vertex by the other end of their edge. Those of other vertices are as good as none: nothing is cleared.
struct Spoke {
    int32_t vert, head;
    int32_t place; // among the corners of the vertex
};
struct FanCorner {
    int32_t corner;
    int32_t back, apex; // the corner before it in its face, whose edge arrives from there
    int32_t next;       // place of the corner that leaves along that edge: the next one counter-clockwise; -1 on the boundary
};

using Int4 = int32_t __attribute__((vector_size(16)));

inline Int4 load(const int32_t* from) {
    Int4 four;
    std::memcpy(&four, from, sizeof four);
    return four;
}

class Linker {
public:
    Linker(const CornersOfVertices& corners, Mesh& mesh, int32_t* least_neighbour)
        : corners_(corners), vert_(mesh.corner_vert.data()), twin_(mesh.corner_twin.data()), least_neighbour_(least_neighbour) {
        for (Spoke& spoke : spokes_) spoke.vert = -1;
    }

    // Twins of the corners of the vertices [begin, end), but of those with more than kMost.
    static constexpr int32_t kMost = 64;
    void run(int64_t begin, int64_t end) {
        while (begin < end) {
            int64_t last = begin + 1;
            while (last < end && corners_.end(last) - corners_.begin(begin) <= kBatch) ++last;
            if (last > begin + 1 || corners_.count(begin) <= kBatch)
                link_batch(begin, last);
            else
                most = std::max(most, corners_.count(begin));
            begin = last;
        }
    }

    // The same for one vertex. There is room for twice as many spokes as corners (a power of two), and for all corners.
    void link(int64_t v, Spoke* spokes, int64_t spoke_count, FanCorner* around) {
        const int32_t* const corners = corners_.begin(v);
        const int32_t count = corners_.count(v), vertex = static_cast<int32_t>(v);
        int32_t least = vertex;
        const int shift = 32 - std::countr_zero(static_cast<uint64_t>(spoke_count));
        const int64_t last = spoke_count - 1;
        const auto find = [&](int32_t head) -> Spoke& { // the spoke, or the free one where it belongs
            int64_t i = (static_cast<uint32_t>(head) * 0x9e3779b1u) >> shift;
            while (spokes[i].vert == vertex && spokes[i].head != head) i = (i + 1) & last;
            return spokes[i];
        };
        for (int32_t i = 0; i < count; ++i) {
            const int32_t c = corners[i], head = vert_[next_corner(c)];
            around[i] = {c, prev_corner(c), vert_[prev_corner(c)], -1};
            twin_[c] = kBoundary;
            least = std::min({least, head, around[i].apex});
            Spoke& spoke = find(head);
            links.oriented_manifold &= spoke.vert != vertex; // else two faces run along the edge the same way
            spoke = {vertex, head, i};
        }
        int32_t linked = 0;
        for (int32_t i = 0; i < count; ++i) {
            const Spoke& spoke = find(around[i].apex);
            if (spoke.vert != vertex) continue;
            twin_[around[spoke.place].corner] = around[i].back;
            around[i].next = spoke.place;
            ++linked;
        }
        least_neighbour_[v] = least;
        links.boundary_edges += count - linked;
        // Once around, from anywhere or from the one corner at the boundary.
        int32_t start = 0;
        if (linked < count)
            while (start < count - 1 && twin_[around[start].corner] >= 0) ++start;
        int32_t steps = 0;
        for (int32_t i = start; i >= 0 && steps < count && (steps == 0 || i != start); i = around[i].next) ++steps;
        links.several_fans |= steps != count;
    }

    FanLinks links{true, false, 0};
    int32_t most = 0; // corners of a vertex that was left out

private:
    static constexpr int32_t kBatch = 256; // corners
    static constexpr int32_t kFew = 8;     // corners of a vertex that are compared all with all
    static constexpr int32_t kOne = 1 << 16, kPlace = 2 * kBatch - 1;
    static constexpr int64_t kSpokes = 256; // kept nearly empty, so that there are hardly any collisions

    // Most vertices have few corners, and one fan all around. Each step is done for many of them, so that none waits for the one
    // before it, and without branches, for no one can predict how many corners a vertex has.
    void link_batch(int64_t begin, int64_t end) {
        const int32_t* const corners = corners_.begin(begin);
        const int32_t count = static_cast<int32_t>(corners_.end(end - 1) - corners);
        const int32_t soon = static_cast<int32_t>(std::min<int64_t>(count, corners_.limit() - corners - kBatch));
        for (int32_t i = 0; i < soon; ++i) { // of the next batch
            __builtin_prefetch(vert_ + corners[i + kBatch]);
            __builtin_prefetch(twin_ + corners[i + kBatch], 1);
        }
        for (int32_t i = 0; i < count; ++i) {
            ahead_[i] = next_corner(corners[i]);
            back_[i] = prev_corner(corners[i]);
        }
        for (int32_t i = 0; i < count; ++i) {
            head_[i] = vert_[ahead_[i]];
            apex_[i] = vert_[back_[i]];
        }
        // before_: how many edges arrive from where a corner's edge leads, times kOne, and the place of the last of them.
        alignas(16) static constexpr int32_t kPast[2 * kFew] = {0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1};
        for (int64_t v = begin; v < end; ++v) {
            const int32_t at = static_cast<int32_t>(corners_.begin(v) - corners), size = std::min(corners_.count(v), kFew);
            const Int4 low = load(head_ + at), high = load(head_ + at + 4);
            const Int4 from[2] = {load(apex_ + at) | load(kPast + kFew - size),
                                  load(apex_ + at + 4) | load(kPast + kFew + 4 - size)};
            Int4 found_low{}, found_high{}, entry = Int4{} + (kOne + at);
            for (int i = 0; i < kFew; ++i) {
                const Int4 apex = Int4{} + from[i / 4][i % 4];
                found_low += (low == apex) & entry;
                found_high += (high == apex) & entry;
                entry += 1;
            }
            std::memcpy(before_ + at, &found_low, sizeof found_low);
            std::memcpy(before_ + at + 4, &found_high, sizeof found_high);
            // Around a closed fan the apexes are all of the neighbours. None: -1 becomes kNoNeighbour.
            const Int4 a = from[0] & kNoNeighbour, b = from[1] & kNoNeighbour, four = a < b ? a : b;
            const int32_t least = std::min(std::min(four[0], four[1]), std::min(four[2], four[3]));
            least_neighbour_[v] = size == 0 ? kNoNeighbour : std::min(least, static_cast<int32_t>(v));
        }
        for (int32_t i = 0; i < count; ++i) twin_[corners[i]] = back_[before_[i] & kPlace];
        for (int64_t v = begin; v < end; ++v) {
            const int32_t at = static_cast<int32_t>(corners_.begin(v) - corners), size = corners_.count(v);
            int32_t place = at, home = -1; // after as many steps as there are corners
            uint64_t seen = 0;
            bool one = true;
            for (int i = 0; i < kFew; ++i) { // once around, or more often
                const int32_t before = before_[place];
                one &= before >> 16 == 1;
                seen |= uint64_t{1} << ((place - at) & 63);
                place = before & kPlace;
                home = i + 1 == size ? place : home;
            }
            // Where two corners lead to the same place, a walk may see all of them and still not come home.
            if (size != 0 && (size > kFew || !one || home != at || seen != (uint64_t{1} << size) - 1)) link_alone(v);
        }
    }

    void link_alone(int64_t v) {
        if (corners_.count(v) <= kMost)
            link(v, spokes_, kSpokes, around_);
        else
            most = std::max(most, corners_.count(v));
    }

    const CornersOfVertices& corners_;
    const int32_t* const vert_;
    int32_t* const twin_;
    int32_t* const least_neighbour_;
    Spoke spokes_[kSpokes];
    FanCorner around_[kMost];
    // Of the corners of a batch, and room for the last vertex to be taken for one with kFew.
    int32_t ahead_[kBatch + kFew] = {}, back_[2 * kBatch] = {}, head_[kBatch + kFew] = {}, apex_[kBatch + kFew] = {},
                            before_[2 * kBatch] = {};
};

} // namespace

Status link_fans(Context& context, double from, double to, Mesh& mesh, FanLinks& found, Array<int32_t>& least_neighbour) {
    found = {true, false, 0};
    mesh.corner_twin.resize_uninitialized(mesh.corners());
    least_neighbour.resize_uninitialized(mesh.vertices());
    if (mesh.faces() == 0) {
        std::fill(least_neighbour.begin(), least_neighbour.end(), kNoNeighbour);
        return DELMESH_OK;
    }
    CornersOfVertices corners(context.memory());
    DM_TRY(context.progress(from));
    DM_TRY(corners.fill(context, mesh));
    DM_TRY(context.progress((from + to) / 2));
    const int64_t vertices = mesh.vertices();
    struct Block {
        FanLinks links;
        int32_t most;
    };
    Array<Block> blocks(context.memory(), (vertices + kVertexGrain - 1) / kVertexGrain, Block{{true, false, 0}, 0});
    DM_TRY(context.parallel(vertices, kVertexGrain, [&](int64_t block, int64_t begin, int64_t end) {
        Linker linker(corners, mesh, least_neighbour.data());
        linker.run(begin, end);
        blocks[block] = {linker.links, linker.most};
    }));
    int32_t most = 0;
    const auto add = [&](const FanLinks& links) {
        found.oriented_manifold &= links.oriented_manifold;
        found.several_fans |= links.several_fans;
        found.boundary_edges += links.boundary_edges;
    };
    for (const Block& block : blocks) {
        add(block.links);
        most = std::max(most, block.most);
    }
    if (most == 0 || !found.oriented_manifold) return DELMESH_OK;
    // The few vertices with more corners.
    const int64_t spoke_count = static_cast<int64_t>(std::bit_ceil(2 * static_cast<uint64_t>(most)));
    Array<Spoke> spokes(context.memory(), spoke_count, Spoke{-1, -1, -1});
    Array<FanCorner> around(context.memory(), most);
    Linker linker(corners, mesh, least_neighbour.data());
    for (int64_t block = 0; block < blocks.size(); ++block) {
        if (blocks[block].most == 0) continue;
        DM_TRY(context.progress(to));
        for (int64_t v = block * kVertexGrain; v < std::min(vertices, (block + 1) * kVertexGrain); ++v)
            if (corners.count(v) > Linker::kMost) linker.link(v, spokes.data(), spoke_count, around.data());
    }
    add(linker.links);
    return DELMESH_OK;
}

} // namespace dm
