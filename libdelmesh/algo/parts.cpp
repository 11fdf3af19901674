// SPDX-License-Identifier: Apache-2.0
// The loop on parts of a large mesh at the same time.
//
// The NLD edges are halved at their median again and again, along the longest axis; the planes cut space into cells, and the cells
// the mesh. A vertex is owned by its cell's part if all its neighbours are in the same cell. What a part changes are faces all of
// whose vertices it owns, and what it reads has an owned vertex in sight, so that no two parts meet. Whatever is near a border is
// left to the loop on the whole, which comes after. The parts depend on the mesh alone: the result is the same for any number of
// threads.
//
// Parts is for preserve, FlipParts for the flips of the other modes, which ask for less.
#include <algorithm>
#include <atomic>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "algo/loop.h"
#include "base/box.h"

namespace dm {
namespace {

constexpr int64_t kEdgesPerPart = 1024; // at least: a smaller part is mostly border
constexpr int32_t kMostLevels = 6;
constexpr uint8_t kNobody = 255;
constexpr int64_t kGrain = 1024; // edges whose part is looked for

constexpr int64_t kStepsPerSlice = 65536; // of all parts together, flips and splits: about a tenth of a second. A trial is eight.
constexpr int kMostTurns = 8;
constexpr int kMostRefills = 10; // where splits spread: beside edges that no part may touch they might do so for ever
constexpr int32_t kMoreMoves = 256;
constexpr int64_t kMoreEntries = 1024, kTrialEntries = 2048;

// Planes that cut space into 2^levels cells, as an implicit binary tree. A mirrored mesh has the mirrored cells: a plane lies
// midway between the two middle points, and what is on it belongs to neither side.
struct Cells {
    int levels = 0;
    int8_t axis[1 << kMostLevels] = {};
    double at[1 << kMostLevels] = {};

    static double coordinate(const Vec3& x, int axis) { return axis == 0 ? x.x : axis == 1 ? x.y : x.z; }
    uint8_t of(const Vec3& x) const {
        int node = 1;
        for (int level = 0; level < levels; ++level) {
            const double here = coordinate(x, axis[node]);
            if (here == at[node]) return kNobody;
            node = 2 * node + (here < at[node] ? 0 : 1);
        }
        return static_cast<uint8_t>(node - (1 << levels));
    }
    void cut(Vec3* points, int64_t count, int node, int level) {
        if (level == levels || count == 0) return;
        Box box;
        for (int64_t i = 0; i < count; ++i) box.extend(points[i]);
        const Vec3 size = box.hi - box.lo;
        const int k = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
        const auto less = [k](const Vec3& a, const Vec3& b) { return coordinate(a, k) < coordinate(b, k); };
        Vec3* const end = points + count;
        Vec3* const middle = points + count / 2;
        std::nth_element(points, middle, end, less);
        double plane = coordinate(*middle, k);
        if (count % 2 == 0) plane = 0.5 * (plane + coordinate(*std::max_element(points, middle, less), k));
        axis[node] = static_cast<int8_t>(k);
        at[node] = plane;
        Vec3* const below = std::partition(points, end, [&](const Vec3& x) { return coordinate(x, k) < plane; });
        Vec3* const on = std::partition(below, end, [&](const Vec3& x) { return coordinate(x, k) == plane; });
        cut(points, below - points, 2 * node, level + 1);
        cut(on, end - on, 2 * node + 1, level + 1);
    }
};

} // namespace

class Parts {
public:
    explicit Parts(Loop& whole_) : whole(whole_), owner(whole_.context.memory()) {}
    ~Parts() {
        for (int32_t i = 0; i < count; ++i) parts[i].~Part();
        whole.context.memory().deallocate(parts, static_cast<size_t>(1 << cells.levels) * sizeof(Part));
    }
    Parts(const Parts&) = delete;
    Parts& operator=(const Parts&) = delete;

    Status run() {
        Array<Loop::Entry>& ready = whole.ready;
        int64_t valid = 0;
        for (const Loop::Entry& e : ready)
            if (whole.still_nld(e)) ready[valid++] = e;
        ready.resize_uninitialized(valid);
        while ((kEdgesPerPart << (cells.levels + 1)) <= whole.ready.size() && cells.levels < kMostLevels) ++cells.levels;
        if (cells.levels == 0) return DELMESH_OK;
        cut_into_cells();
        DM_TRY(find_owners());
        DM_TRY(hand_out());
        const int64_t steps = std::max<int64_t>(kStepsPerSlice / count, 64);
        for (int refills = 0; refills <= kMostRefills;) { // what the last one brings is for trials
            DM_TRY(for_each([steps](Loop& part) { return part.steps_left = steps, part.drain(); }, 0));
            bool waits = false; // with something to do and room to do it
            for (int32_t i = 0; i < count; ++i) {
                const Loop& loop = parts[i].loop;
                reserve_queues(parts[i]);
                waits |= !(loop.ready.empty() && loop.blocked.empty()) && loop.has_room();
            }
            if (waits) continue;
            if (!refill()) break;
            ++refills;
        }
        for (int32_t i = 0; i < count; ++i) set_aside(parts[i].loop);
        if (whole.shrinks()) {
            prepare_trials();
            DM_TRY(for_each_with_trials([](Loop& part) { return part.take_out_needless(); }, 0.3));
            const int32_t rounds = whole.search_rounds();
            for (int32_t round = 0; round < rounds; ++round) {
                const double done = 0.3 + 0.7 * round / rounds;
                DM_TRY(for_each([round](Loop& part) { return part.begin_search(round), DELMESH_OK; }, done));
                for (bool left = true; left;) {
                    for (int32_t i = 0; i < count; ++i)
                        parts[i].surface.reserve_freed(std::min(parts[i].loop.trials_left, steps / 8) * Loop::kMostTaken);
                    DM_TRY(for_each_with_trials([steps](Loop& part) { return part.search(steps / 8); }, done));
                    left = false;
                    for (int32_t i = 0; i < count; ++i) left |= parts[i].loop.trials_left > 0;
                }
            }
        }
        take_back();
        return DELMESH_OK;
    }

private:
    struct Part {
        Part(Loop& whole, uint8_t number)
            : surface(whole.s, number), patches(*whole.patches), loop(whole.context, surface, &patches, whole.rules, report) {}
        Surface surface;
        FlatPatches patches;
        delmesh_remesh_report report{};
        Loop loop;
        Status status = DELMESH_OK;
        int32_t more = 0, more_moves = kMoreMoves; // vertices, and flips that move the surface: to be supplied next
        int64_t supplied = 0, moves = 0;           // in all
        int64_t most_own = 0;                      // entries of loop.own and loop.centres
    };

    void cut_into_cells() {
        const Surface& s = whole.s;
        Array<Vec3> middles(whole.context.memory());
        middles.reserve(whole.ready.size());
        for (const Loop::Entry& e : whole.ready) middles.push_back(0.5 * (s.at(e.p) + s.at(e.q)));
        cells.cut(middles.data(), middles.size(), 1, 0);
        // Parts are numbered by the first vertex pair of their edges: a mirrored mesh has the same first, not the same left.
        struct First {
            VertexPair edge{std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::max()};
            uint8_t cell = 0;
        } firsts[1 << kMostLevels];
        const int32_t most = 1 << cells.levels;
        for (int32_t i = 0; i < most; ++i) firsts[i].cell = static_cast<uint8_t>(i);
        for (const Loop::Entry& e : whole.ready) {
            const uint8_t cell = cells.of(0.5 * (s.at(e.p) + s.at(e.q)));
            if (cell != kNobody) firsts[cell].edge = std::min(firsts[cell].edge, VertexPair(e.p, e.q));
        }
        std::sort(firsts, firsts + most,
                  [](const First& a, const First& b) { return a.edge < b.edge || (!(b.edge < a.edge) && a.cell < b.cell); });
        for (int32_t i = 0; i < most; ++i) part_of_cell[firsts[i].cell] = static_cast<uint8_t>(i);
    }

    // Vertices that several threads find at the border are written the same value by each.
    Status find_owners() {
        Surface& s = whole.s;
        owner.resize_uninitialized(s.vertices());
        constexpr int64_t kVertexGrain = 16384;
        DM_TRY(whole.context.parallel(s.vertices(), kVertexGrain, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t v = begin; v < end; ++v) {
                const uint8_t cell = cells.of(s.at(static_cast<int32_t>(v)));
                owner[v] = cell == kNobody ? kNobody : part_of_cell[cell];
            }
        }));
        Array<uint8_t> at_border(whole.context.memory(), s.vertices(), 0);
        DM_TRY(whole.context.parallel(s.faces(), kVertexGrain, [&](int64_t, int64_t begin, int64_t end) {
            const auto mark = [&](int32_t v) { std::atomic_ref<uint8_t>(at_border[v]).store(1, std::memory_order_relaxed); };
            for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) {
                if (s.is_dead(f)) continue;
                const int32_t c = 3 * f, a = s.vert(c), b = s.vert(c + 1), d = s.vert(c + 2);
                // What was cut at import is one thing for several sheets, and too rare to bother.
                const bool cut = is_cut(s.twin(c)) || is_cut(s.twin(c + 1)) || is_cut(s.twin(c + 2));
                if (cut || owner[a] == kNobody || owner[a] != owner[b] || owner[b] != owner[d])
                    for (const int32_t v : {a, b, d}) mark(v);
            }
        }));
        for (int64_t v = 0; v < owner.size(); ++v)
            if (at_border[v] != 0) owner[v] = kNobody;
        // After the first turn there are split vertices. A carrier counts them, so they must be of one part all together.
        constexpr uint8_t kUnseen = 254;
        Array<uint8_t> carrier_owner(whole.context.memory(), s.carriers.size(), kUnseen);
        for (int pass = 0; pass < 2; ++pass)
            for (int32_t v = s.first_split; v < s.vertices(); ++v) {
                if (s.vert_corner[v] < 0) continue;
                uint8_t& all = carrier_owner[s.split_vertices[v - s.first_split].carrier];
                if (pass == 1)
                    owner[v] = all;
                else if (all != owner[v])
                    all = all == kUnseen ? owner[v] : kNobody;
            }
        return DELMESH_OK;
    }

    uint8_t owner_of(int32_t corner) const {
        const Surface& s = whole.s;
        const uint8_t part = owner[s.vert(corner)];
        const bool all = owner[s.head(corner)] == part && owner[s.apex(corner)] == part &&
                         (s.is_boundary(corner) || owner[s.apex(s.twin(corner))] == part);
        return all ? part : kNobody;
    }

    // Makes the parts, and gives each its NLD edges. What is nobody's stays in the whole's queue.
    Status hand_out() {
        Memory& memory = whole.context.memory();
        const int32_t most = 1 << cells.levels;
        Array<uint8_t> part_of(memory, whole.ready.size());
        DM_TRY(whole.context.parallel(part_of.size(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i) part_of[i] = owner_of(whole.ready[i].corner);
        }));
        int32_t edges[kNobody + 1] = {};
        for (const uint8_t part : part_of) ++edges[part];
        const double all = static_cast<double>(whole.ready.size());
        parts = static_cast<Part*>(memory.allocate(static_cast<size_t>(most) * sizeof(Part)));
        for (int32_t i = 0; i < most; ++i) {
            new (&parts[i]) Part(whole, static_cast<uint8_t>(i));
            ++count;
            parts[i].more = edges[i] + edges[i] / 4 + 256;
            Loop& loop = parts[i].loop;
            loop.ready.reserve(edges[i] + kMoreEntries);
            loop.pieces.reserve(4);
            loop.trial_made.reserve(64);
            loop.region.reserve(64);
            loop.nld_at_start = Array<VertexPair>::alias(whole.nld_at_start);
            loop.share = edges[i] / all;
            whole.share -= loop.share;
            loop.random_state = static_cast<uint64_t>(i + 1) << 32;
        }
        supply();
        int64_t left = 0;
        for (int64_t i = 0; i < part_of.size(); ++i)
            if (part_of[i] == kNobody)
                whole.ready[left++] = whole.ready[i];
            else
                parts[part_of[i]].loop.ready.push_back(whole.ready[i]);
        Array<Loop::Entry> rest(memory);
        rest.reserve(left);
        for (int64_t i = 0; i < left; ++i) rest.push_back(whole.ready[i]);
        whole.ready = std::move(rest);
        for (int32_t i = 0; i < count; ++i) std::make_heap(parts[i].loop.ready.begin(), parts[i].loop.ready.end());
        return DELMESH_OK;
    }

    template <class Work>
    Status for_each(Work&& work, double done) {
        DM_TRY(whole.context.progress(done));
        DM_TRY(whole.context.parallel(count, 1, [&](int64_t i, int64_t, int64_t) { parts[i].status = work(parts[i].loop); }));
        for (int32_t i = 0; i < count; ++i) DM_TRY(parts[i].status);
        return DELMESH_OK;
    }

    // Numbers and memory for `more` vertices and `more_moves` flips in each part, as far as the limit of vertices goes.
    void supply() {
        int64_t wanted = 0;
        int32_t moves = 0;
        for (int32_t i = 0; i < count; ++i) {
            wanted += parts[i].more;
            moves += parts[i].more_moves; // far from 2^31: kMostRefills
        }
        const int64_t limit = std::max<int64_t>(0, whole.rules.max_vertices - whole.s.vertices_in_use());
        int32_t all = 0;
        for (int32_t i = 0; i < count; ++i) {
            if (wanted > limit) parts[i].more = static_cast<int32_t>(limit * parts[i].more / wanted);
            all += parts[i].more;
        }
        Surface::Supply supply = whole.s.grow_blank(all, 2 * all, all);
        FlatPatches::Share patches = whole.patches->grow_blank(whole.s, moves);
        owner.reserve(owner.size() + all);
        for (int32_t i = 0; i < count; ++i)
            for (int32_t v = 0; v < parts[i].more; ++v) owner.push_back(static_cast<uint8_t>(i));
        for (int32_t i = 0; i < count; ++i) {
            Part& part = parts[i];
            const int32_t more = part.more;
            supply.verts.end = supply.verts.next + more;
            supply.faces.end = supply.faces.next + 2 * more;
            supply.carriers.end = supply.carriers.next + more;
            part.surface.refresh(whole.s, owner.data());
            part.patches.refresh(*whole.patches);
            if (more > 0) part.surface.supply(supply);
            if (part.more_moves > 0) part.patches.supply(patches.first(part.more_moves));
            supply.verts.next = supply.verts.end;
            supply.faces.next = supply.faces.end;
            supply.carriers.next = supply.carriers.end;
            patches = patches.after(part.more_moves);
            reserve_queues(part);
            part.supplied += more;
            part.moves += part.more_moves;
            part.most_own = std::max(part.most_own, part.loop.own.size() + 2 * static_cast<int64_t>(more));
            part.loop.own.reserve(std::min(part.supplied, part.most_own)); // an entry for each split
            part.more = part.more_moves = 0;
        }
    }

    // Queues are not given the most that they may ever need, which is many times what they do: those that are nearly full grow
    // between two slices.
    static void reserve_queues(Part& part) {
        Loop& loop = part.loop;
        for (Array<Loop::Entry>* entries : {&loop.ready, &loop.blocked})
            if (entries->room() < kMoreEntries / 2) entries->reserve(entries->size() + entries->size() / 4 + kMoreEntries);
        if (loop.deferred.room() < kMoreEntries / 8) loop.deferred.reserve(loop.deferred.size() + kMoreEntries / 2);
        part.surface.reserve_freed(64);
    }

    // What one trial at a time needs. A part has it while it runs; in between, nothing of it is in use.
    struct Trials {
        explicit Trials(Memory& memory) : surface(memory), patches(memory), ready(memory), blocked(memory) {
            ready.reserve(kTrialEntries);
            blocked.reserve(kTrialEntries);
        }
        void swap_with(Part& part) {
            part.surface.swap_log(surface);
            part.patches.swap_log(patches);
            std::swap(part.loop.ready, ready);
            std::swap(part.loop.blocked, blocked);
        }
        Surface::TrialLog surface;
        FlatPatches::TrialLog patches;
        Array<Loop::Entry> ready, blocked;
    };

    void prepare_trials() {
        threads = std::min(count, whole.context.max_threads());
        for (int32_t i = 0; i < threads; ++i) trials[i].emplace(whole.context.memory());
        for (int32_t i = 0; i < count; ++i) {
            Loop& loop = parts[i].loop;
            loop.ready.free_storage();
            loop.blocked.free_storage();
            loop.own.reserve(parts[i].most_own);
            loop.centres.reserve(parts[i].most_own);
            parts[i].surface.reserve_freed(loop.own.size());
        }
    }

    // Each thread has one Trials and takes the next part that nobody has taken.
    template <class Work>
    Status for_each_with_trials(Work&& work, double done) {
        std::atomic<int32_t> next{0};
        DM_TRY(whole.context.progress(done));
        DM_TRY(whole.context.parallel(threads, 1, [&](int64_t thread, int64_t, int64_t) {
            for (int32_t i = next++; i < count && !whole.context.cancel_requested(); i = next++) {
                trials[thread]->swap_with(parts[i]);
                parts[i].status = work(parts[i].loop);
                trials[thread]->swap_with(parts[i]);
            }
        }));
        for (int32_t i = 0; i < count; ++i) DM_TRY(parts[i].status);
        return DELMESH_OK;
    }

    // Supplies parts that stopped for want of room with what they lack, by half of what they used: all arrays of the surface are
    // copied each time. False if there is none, or the limit of vertices forbids it.
    bool refill() {
        bool wanted = false;
        for (int32_t i = 0; i < count; ++i) {
            Loop& loop = parts[i].loop;
            if (loop.ready.empty() && loop.blocked.empty()) continue;
            const auto half = [](int64_t used) { return static_cast<int32_t>(std::min<int64_t>(used / 2 + 256, 1 << 24)); };
            if (!parts[i].surface.has_room()) parts[i].more = half(loop.report.splits);
            if (!parts[i].patches.has_room()) parts[i].more_moves = half(parts[i].moves);
            wanted = true;
        }
        if (!wanted || whole.s.vertices_in_use() + count >= whole.rules.max_vertices) return false;
        supply();
        return true;
    }

    // What a part had no room for is the whole's; trials begin with empty queues.
    static void set_aside(Loop& part) {
        for (Array<Loop::Entry>* entries : {&part.ready, &part.blocked}) {
            for (const Loop::Entry& e : *entries) part.deferred.push_back(e);
            entries->clear();
        }
        part.deferred.reserve(part.deferred.size() + 16);
    }

    // Everything that parts were not allowed to touch, or had no room for, is now for the whole.
    void take_back() {
        for (int32_t i = 0; i < count; ++i) {
            Part& part = parts[i];
            whole.s.take_back(part.surface);
            for (const Loop::Entry& e : part.loop.deferred) whole.ready.push_back(e);
            delmesh_remesh_report& sum = whole.report;
            const delmesh_remesh_report& its = part.report;
            sum.flips += its.flips;
            sum.flips_after += its.flips_after;
            sum.splits += its.splits;
            sum.boundary_splits += its.boundary_splits;
            sum.kept_splits += its.kept_splits;
            sum.unflippable += its.unflippable;
            sum.unflippable_2 += its.unflippable_2;
            sum.unflippable_3 += its.unflippable_3;
            sum.unflippable_4 += its.unflippable_4;
            sum.guarded += its.guarded;
            sum.moved_within_tolerance += its.moved_within_tolerance;
        }
        whole.splitting |= whole.report.splits != 0;
    }

    Loop& whole;
    Cells cells;
    uint8_t part_of_cell[1 << kMostLevels] = {};
    Array<uint8_t> owner; // per vertex
    Part* parts = nullptr;
    int32_t count = 0;
    std::optional<Trials> trials[1 << kMostLevels];
    int32_t threads = 0; // that have one
};

// Flips alone, in any mode that may flip every edge. They add nothing and leave all vertices where they are, so parts need neither
// numbers nor vertices of their own: a part flips an edge if the four vertices around it are in its cell. Then it writes faces with
// all vertices, and twins of edges with both ends, in its cell. It reads more, but nothing that another part writes.
class FlipParts {
public:
    explicit FlipParts(Loop& whole_) : whole(whole_) {}
    ~FlipParts() {
        for (int32_t i = 0; i < count; ++i) parts[i].~Part();
        whole.context.memory().deallocate(parts, size_of_parts());
    }
    FlipParts(const FlipParts&) = delete;
    FlipParts& operator=(const FlipParts&) = delete;

    Status run() {
        Array<Loop::Entry>& ready = whole.ready;
        while ((kEdgesPerPart << (cells.levels + 1)) <= ready.size() && cells.levels < kMostLevels) ++cells.levels;
        cut_into_cells();
        DM_TRY(hand_out());
        DM_TRY(whole.context.parallel(count, 1,
                                      [&](int64_t i, int64_t, int64_t) { flip_inside(static_cast<uint8_t>(i), parts[i].loop); }));
        for (int32_t i = 0; i < count; ++i) {
            for (const Array<Loop::Entry>* left : {&parts[i].loop.ready, &parts[i].loop.deferred})
                for (const Loop::Entry& e : *left) ready.push_back(e);
            whole.report.flips += parts[i].report.flips;
        }
        return DELMESH_OK;
    }

private:
    struct Part {
        explicit Part(Loop& whole) : loop(whole.context, whole.s, nullptr, whole.rules, report) {}
        delmesh_remesh_report report{};
        Loop loop;
    };

    size_t size_of_parts() const { return static_cast<size_t>(1 << cells.levels) * sizeof(Part); }

    void cut_into_cells() {
        constexpr int64_t kEnough = 128; // edges of a cell, for planes that halve all of them well
        const Array<Loop::Entry>& ready = whole.ready;
        const int64_t step = std::max<int64_t>(1, ready.size() / (kEnough << cells.levels));
        Array<Vec3> middles(whole.context.memory());
        middles.reserve(ready.size() / step + 1);
        for (int64_t i = 0; i < ready.size(); i += step)
            middles.push_back(0.5 * (whole.s.at(ready[i].p) + whole.s.at(ready[i].q)));
        cells.cut(middles.data(), middles.size(), 1, 0);
    }

    // Of all four vertices around the edge.
    uint8_t cell_of(int32_t corner) const {
        const Surface& s = whole.s;
        const uint8_t cell = cells.of(s.at(s.vert(corner)));
        const bool all = cells.of(s.at(s.head(corner))) == cell && cells.of(s.at(s.apex(corner))) == cell &&
                         (s.is_boundary(corner) || cells.of(s.at(s.apex(s.twin(corner)))) == cell);
        return all ? cell : kNobody;
    }

    Status hand_out() {
        Memory& memory = whole.context.memory();
        Array<Loop::Entry>& ready = whole.ready;
        Array<uint8_t> cell(memory, ready.size());
        DM_TRY(whole.context.parallel(ready.size(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i) cell[i] = cell_of(ready[i].corner);
        }));
        int64_t edges[kNobody + 1] = {};
        for (const uint8_t k : cell) ++edges[k];
        parts = static_cast<Part*>(memory.allocate(size_of_parts()));
        for (int32_t i = 0; i < 1 << cells.levels; ++i) {
            new (&parts[i]) Part(whole);
            ++count;
            // A flip takes an edge out and makes one or two NLD, seldom more; what there is no room for is left to the whole.
            for (Array<Loop::Entry>* entries : {&parts[i].loop.ready, &parts[i].loop.deferred})
                entries->reserve(2 * edges[i] + 64);
        }
        int64_t left = 0;
        for (int64_t i = 0; i < ready.size(); ++i)
            if (cell[i] == kNobody)
                ready[left++] = ready[i];
            else
                parts[cell[i]].loop.ready.push_back(ready[i]);
        ready.resize_uninitialized(left);
        return DELMESH_OK;
    }

    void flip_inside(uint8_t cell, Loop& part) const {
        constexpr int64_t kMostAdded = 4; // by a flip
        std::make_heap(part.ready.begin(), part.ready.end());
        for (int64_t steps = 1; !part.ready.empty() && part.ready.room() >= kMostAdded && part.deferred.room() > 0; ++steps) {
            if ((steps & 0x3ff) == 0 && whole.context.cancel_requested()) return;
            std::pop_heap(part.ready.begin(), part.ready.end());
            const Loop::Entry e = part.ready.pop_back();
            if (!part.still_nld(e)) continue;
            const bool mine = cell_of(e.corner) == cell;
            const Judgement judgement = mine ? part.judge(e.corner) : Judgement{Verdict::kept, {}};
            if (judgement.verdict == Verdict::flip)
                part.do_flip(e.corner, judgement.free);
            else
                part.deferred.push_back(e);
        }
    }

    Loop& whole;
    Cells cells;
    Part* parts = nullptr;
    int32_t count = 0;
};

Status Loop::flip_parts() {
    constexpr int64_t kFewest = 4 * kEdgesPerPart; // below that the paper's order, as one thread is as fast
    return ready.size() < kFewest ? DELMESH_OK : FlipParts(*this).run();
}

Status Loop::run_parts() {
    // What is left by the first parts is near their borders, or there was no room for: other parts may take it.
    for (int turn = 0; turn < kMostTurns; ++turn) {
        const int64_t before = ready.size();
        if (before < 2 * kEdgesPerPart) break;
        DM_TRY(Parts(*this).run());
        if (ready.size() > before / 2) break;
    }
    return DELMESH_OK;
}

} // namespace dm
