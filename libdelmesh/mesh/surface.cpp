// SPDX-License-Identifier: Apache-2.0
#include "mesh/surface.h"

#include <algorithm>
#include <utility>

namespace dm {

Surface::Surface(Context& context, const Mesh& in, Precision precision, int64_t room)
    : pos(context.memory()), corner_vert(context.memory()), corner_twin(context.memory()), corner_bits(context.memory()),
      vert_corner(context.memory()), face_src(context.memory()), cut_slots(context.memory()), vert_root(context.memory()),
      copy_of(context.memory()), carriers(context.memory()), carrier_splits(context.memory()), split_vertices(context.memory()),
      pins(context.memory()), changes_(context.memory()), changed_bits_(context.memory()), changed_slots_(context.memory()),
      new_verts_(context.memory()), new_faces_(context.memory()), new_carriers_(context.memory()) {
    const int32_t vertex_count = in.vertices(), corner_count = in.corners();
    for (Array<int32_t>* corners_array : {&corner_vert, &corner_twin}) corners_array->reserve(corner_count + 6 * room);
    corner_bits.reserve(corner_count + 6 * room);
    face_src.reserve(corner_count / 3 + 2 * room);
    vert_corner.reserve(vertex_count + room);
    pos.reserve(vertex_count + room);
    pos.resize_uninitialized(vertex_count);
    corner_vert.resize_uninitialized(corner_count);
    corner_twin.resize_uninitialized(corner_count);
    corner_bits.resize_uninitialized(corner_count);
    face_src.resize_uninitialized(corner_count / 3);
    vert_corner.resize_uninitialized(vertex_count);
    cut_slots.copy_from(in.cut_slots);
    const auto copy_vertices = [&](int64_t begin, int64_t end) {
        for (int64_t v = begin; v < end; ++v) pos[v] = in.position(static_cast<int32_t>(v));
        if (in.precision != precision)
            for (int64_t v = begin; v < end; ++v) pos[v] = round_to(precision, pos[v]);
    };
    const auto copy_faces = [&](int64_t begin, int64_t end) {
        std::copy(in.corner_vert.begin() + 3 * begin, in.corner_vert.begin() + 3 * end, corner_vert.begin() + 3 * begin);
        std::copy(in.corner_twin.begin() + 3 * begin, in.corner_twin.begin() + 3 * end, corner_twin.begin() + 3 * begin);
        if (in.corner_bits.empty())
            std::fill(corner_bits.begin() + 3 * begin, corner_bits.begin() + 3 * end, EdgeBits{0});
        else
            std::copy(in.corner_bits.begin() + 3 * begin, in.corner_bits.begin() + 3 * end, corner_bits.begin() + 3 * begin);
        for (int64_t f = begin; f < end; ++f) face_src[f] = static_cast<int32_t>(f);
    };
    const auto find_corners = [&] { // the first of each vertex, or the one at the boundary
        const int32_t* const vert = in.corner_vert.data();
        const int32_t* const twin = in.corner_twin.data();
        int32_t* const corner = vert_corner.data();
        std::fill_n(corner, vertex_count, -1);
        int32_t signs = 0;
        for (int32_t c = corner_count - 1; c >= 0; --c) {
            corner[vert[c]] = c;
            signs |= twin[c];
        }
        if (signs >= 0) return; // no boundary
        for (int32_t c = 0; c < corner_count; ++c)
            if (twin[c] < 0) corner[vert[c]] = c;
    };
    // After a cancel the arrays are left as they are; whoever made the Surface hears of it from the next progress().
    constexpr int64_t kPiece = 1 << 15;
    const int64_t vertex_pieces = (vertex_count + kPiece - 1) / kPiece, face_pieces = (in.faces() + kPiece - 1) / kPiece;
    static_cast<void>(context.parallel(1 + face_pieces + vertex_pieces, 1, [&](int64_t task, int64_t, int64_t) {
        const int64_t piece = task <= face_pieces ? task - 1 : task - 1 - face_pieces;
        const int64_t count = task <= face_pieces ? in.faces() : vertex_count;
        const int64_t begin = piece * kPiece, end = std::min(count, begin + kPiece);
        if (task == 0)
            find_corners();
        else if (task <= face_pieces)
            copy_faces(begin, end);
        else
            copy_vertices(begin, end);
    }));
    if (!cut_slots.empty()) {
        if (in.vert_join.empty()) {
            vert_root.resize_uninitialized(vertex_count);
            for (int32_t v = 0; v < vertex_count; ++v) vert_root[v] = v;
        } else
            vert_root.copy_from(in.vert_join);
    }
    first_copy = first_split = vertex_count;
}

bool Surface::adjacent(int32_t a, int32_t b) const {
    const int32_t start = vert_corner[a];
    int32_t c = start;
    do {
        if (head(c) == b) return true;
        const int32_t last = prev_corner(c); // its edge arrives from the next neighbour
        c = corner_twin[last];
        if (c < 0) return corner_vert[last] == b;
    } while (c != start);
    return false;
}

bool Surface::has_face(int32_t a, int32_t b, int32_t c) const {
    const int32_t start = vert_corner[a];
    int32_t k = start;
    do {
        const int32_t h = head(k), w = apex(k);
        if ((h == b && w == c) || (h == c && w == b)) return true;
        k = rotate(k);
    } while (k >= 0 && k != start);
    return false;
}

int32_t Surface::carrier_of(int32_t p, int32_t q, double& tp, double& tq) {
    // An edge with an end inside a carrier lies on that carrier if its other end does; so no table of edges is needed.
    for (int turn = 0; turn < 2; ++turn) {
        const int32_t inside = turn == 0 ? p : q, other = turn == 0 ? q : p;
        double& t_inside = turn == 0 ? tp : tq;
        double& t_other = turn == 0 ? tq : tp;
        if (is_original(inside)) continue;
        const SplitVertex& s = split_vertices[inside - first_split];
        t_inside = s.t;
        if (carriers[s.carrier].a == other) return t_other = 0, s.carrier;
        if (carriers[s.carrier].b == other) return t_other = 1, s.carrier;
        if (!is_original(other) && split_vertices[other - first_split].carrier == s.carrier)
            return t_other = split_vertices[other - first_split].t, s.carrier;
    }
    tp = 0;
    tq = 1;
    return add_carrier(p, q);
}

int32_t Surface::add_carrier(int32_t a, int32_t b) {
    int32_t carrier;
    if (!new_carriers_.take(carrier)) {
        carrier = static_cast<int32_t>(carriers.size());
        carriers.push_back({a, b});
        carrier_splits.push_back(0);
    }
    carriers[carrier] = {a, b};
    put(&Surface::carrier_splits, carrier, 0);
    for (const int32_t end : {a, b})
        if (!is_original(end)) put(&Surface::pins, end - first_split, pins[end - first_split] + 1);
    return carrier;
}

void Surface::release_carrier(int32_t carrier) {
    for (const int32_t end : {carriers[carrier].a, carriers[carrier].b})
        if (!is_original(end)) put(&Surface::pins, end - first_split, pins[end - first_split] - 1);
    new_carriers_.freed.push_back(carrier);
    if (!in_trial_) new_carriers_.keep();
}

bool Surface::on_one_carrier(int32_t a, int32_t b, int32_t c) const {
    const int32_t v[3] = {a, b, c};
    int32_t carrier = -1;
    for (const int32_t x : v)
        if (!is_original(x)) carrier = split_vertices[x - first_split].carrier;
    if (carrier < 0) return false;
    for (const int32_t x : v) {
        const bool here = (!is_original(x) && split_vertices[x - first_split].carrier == carrier) || carriers[carrier].a == x ||
                          carriers[carrier].b == x;
        if (!here) return false;
    }
    return true;
}

void Surface::set_twin(int32_t c, int32_t twin) {
    put(&Surface::corner_twin, c, twin);
    if (twin >= 0)
        put(&Surface::corner_twin, twin, c);
    else if (is_cut(twin)) {
        CutSlot& slot = cut_slots[cut_slot(twin)];
        if (in_trial_) changed_slots_.push_back({cut_slot(twin), slot.corner});
        slot.corner = c;
    }
}

void Surface::flip(int32_t c) {
    const int32_t t = corner_twin[c];
    const int32_t cn = next_corner(c), cp = prev_corner(c), tn = next_corner(t), tp = prev_corner(t);
    const int32_t p = corner_vert[c], q = corner_vert[t], u = corner_vert[cp], v = corner_vert[tp];
    const int32_t beyond_qu = corner_twin[cn], beyond_pv = corner_twin[tn];
    const EdgeBits bits_qu = corner_bits[cn], bits_pv = corner_bits[tn];
    put(&Surface::corner_vert, cn, v); // (p, v, u)
    put(&Surface::corner_vert, tn, u); // (q, u, v)
    set_twin(c, beyond_pv);
    put_bits(c, bits_pv);
    set_twin(t, beyond_qu);
    put_bits(t, bits_qu);
    set_twin(cn, tn);
    put_bits(cn, 0);
    put_bits(tn, 0);
    if (vert_corner[p] == tn) put(&Surface::vert_corner, p, c);
    if (vert_corner[q] == cn) put(&Surface::vert_corner, q, t);
}

int32_t Surface::add_face(int32_t a, int32_t b, int32_t c, int32_t source) {
    const int32_t v[3] = {a, b, c};
    if (int32_t face; new_faces_.take(face)) {
        const int32_t first = 3 * face;
        for (int32_t k = 0; k < 3; ++k) {
            put(&Surface::corner_vert, first + k, v[k]);
            corner_twin[first + k] = kBoundary; // of a dead face: nothing to remember
            corner_bits[first + k] = 0;
        }
        face_src[face] = source;
        --dead_faces;
        return first;
    }
    const int32_t first = corners();
    for (const int32_t x : v) {
        corner_vert.push_back(x);
        corner_twin.push_back(kBoundary);
        corner_bits.push_back(0);
    }
    face_src.push_back(source);
    return first;
}

int32_t Surface::split(int32_t c, int32_t s) {
    const auto split_face = [this](int32_t k, int32_t vertex) {
        // (x, y, z) with the edge k = x -> y becomes (x, s, z), and (s, y, z) is added. Returns the corner s -> y.
        const int32_t kn = next_corner(k);
        const int32_t y = corner_vert[kn], z = corner_vert[prev_corner(k)];
        const int32_t beyond_yz = corner_twin[kn];
        const int32_t fresh = add_face(vertex, y, z, face_src[face_of(k)]);
        corner_bits[fresh] = corner_bits[k];
        corner_bits[fresh + 1] = corner_bits[kn];
        put(&Surface::corner_vert, kn, vertex);
        set_twin(fresh + 1, beyond_yz);
        set_twin(kn, fresh + 2);
        put_bits(kn, 0);
        if (vert_corner[y] == kn) put(&Surface::vert_corner, y, fresh + 1);
        return fresh;
    };
    const int32_t t = corner_twin[c];
    const int32_t tail = split_face(c, s);
    if (t < 0) {
        corner_twin[tail] = kBoundary; // split_everywhere gives the halves of a cut edge their slots
    } else {
        const int32_t other_tail = split_face(t, s); // t: q -> s; other_tail: s -> p
        set_twin(c, other_tail);
        set_twin(tail, t);
    }
    put(&Surface::vert_corner, s, tail);
    return tail;
}

void Surface::unsplit(int32_t c) {
    const auto merge_faces = [this](int32_t k) {
        // (x, s, z) with the edge k = x -> s and (s, y, z) become (x, y, z); the second face goes.
        const int32_t kn = next_corner(k), gone = next_corner(corner_twin[kn]); // gone: s -> y
        const int32_t gn = next_corner(gone), gp = prev_corner(gone);
        const int32_t y = corner_vert[gn], z = corner_vert[gp];
        put(&Surface::corner_vert, kn, y);
        set_twin(kn, corner_twin[gn]);
        put_bits(kn, corner_bits[gn]);
        if (vert_corner[y] == gn) put(&Surface::vert_corner, y, kn);
        if (vert_corner[z] == gp) put(&Surface::vert_corner, z, prev_corner(k));
        for (const int32_t corner : {gone, gn, gp}) put(&Surface::corner_vert, corner, -1);
        ++dead_faces;
        new_faces_.freed.push_back(face_of(gone));
    };
    const int32_t s = head(c);
    const int32_t t = corner_twin[next_corner(corner_twin[next_corner(c)])]; // q -> s
    merge_faces(c);
    if (t >= 0) {
        merge_faces(t);
        set_twin(c, t);
    }
    put(&Surface::vert_corner, s, -1);
    const int32_t carrier = split_vertices[s - first_split].carrier;
    put(&Surface::carrier_splits, carrier, carrier_splits[carrier] - 1);
    if (carrier_splits[carrier] == 0) release_carrier(carrier);
    new_verts_.freed.push_back(s);
    if (!in_trial_) keep_trial();
}

void Surface::begin_trial() {
    in_trial_ = true;
    dead_faces_before_ = dead_faces;
    new_verts_.begin(vertices());
    new_faces_.begin(faces());
    new_carriers_.begin(carriers.size());
}

void Surface::keep_trial() {
    in_trial_ = false;
    changes_.clear();
    changed_bits_.clear();
    changed_slots_.clear();
    new_verts_.keep();
    new_faces_.keep();
    new_carriers_.keep();
}

void Surface::undo_trial() {
    in_trial_ = false;
    for (int64_t i = changes_.size() - 1; i >= 0; --i) (this->*changes_[i].array)[changes_[i].index] = changes_[i].old;
    for (int64_t i = changed_bits_.size() - 1; i >= 0; --i) corner_bits[changed_bits_[i].corner] = changed_bits_[i].old;
    for (int64_t i = changed_slots_.size() - 1; i >= 0; --i) cut_slots[changed_slots_[i].slot].corner = changed_slots_[i].old;
    changes_.clear();
    changed_bits_.clear();
    changed_slots_.clear();
    new_verts_.undo();
    new_faces_.undo();
    new_carriers_.undo();
    if (!is_part()) resize_all(new_verts_.before.size, new_faces_.before.size, new_carriers_.before.size);
    dead_faces = dead_faces_before_;
}

// New elements hold garbage.
void Surface::resize_all(int64_t verts, int64_t faces_size, int64_t carriers_size) {
    pos.resize_uninitialized(verts);
    vert_corner.resize_uninitialized(verts);
    split_vertices.resize_uninitialized(verts - first_split);
    pins.resize_uninitialized(verts - first_split);
    if (!vert_root.empty()) vert_root.resize_uninitialized(verts);
    corner_vert.resize_uninitialized(3 * faces_size);
    corner_twin.resize_uninitialized(3 * faces_size);
    corner_bits.resize_uninitialized(3 * faces_size);
    face_src.resize_uninitialized(faces_size);
    carriers.resize_uninitialized(carriers_size);
    carrier_splits.resize_uninitialized(carriers_size);
}

int32_t Surface::add_vertex(Vec3 position, SplitVertex where, int32_t copied_from) {
    // A vertex is younger than what it was made from; so where its carrier ends at split vertices it gets the next new number.
    const bool may_be_old = where.depth == 1;
    int32_t v;
    if (!may_be_old && new_verts_.range.next < new_verts_.range.end)
        v = new_verts_.range.next++;
    else if (!may_be_old || !new_verts_.take(v))
        return append_vertex(position, where, copied_from);
    pos[v] = position;
    split_vertices[v - first_split] = where;
    if (!vert_root.empty()) vert_root[v] = copied_from < 0 ? v : copied_from;
    put(&Surface::carrier_splits, where.carrier, carrier_splits[where.carrier] + 1);
    return v;
}

int32_t Surface::append_vertex(Vec3 position, SplitVertex where, int32_t copied_from) {
    const int32_t v = vertices();
    pos.push_back(position);
    vert_corner.push_back(-1);
    split_vertices.push_back(where);
    pins.push_back(0);
    if (!vert_root.empty()) vert_root.push_back(copied_from < 0 ? v : copied_from);
    put(&Surface::carrier_splits, where.carrier, carrier_splits[where.carrier] + 1);
    return v;
}

// -- parts

Surface::Surface(Surface& whole, uint8_t number)
    : pos(Array<Vec3>::alias(whole.pos)), corner_vert(Array<int32_t>::alias(whole.corner_vert)),
      corner_twin(Array<int32_t>::alias(whole.corner_twin)), corner_bits(Array<EdgeBits>::alias(whole.corner_bits)),
      vert_corner(Array<int32_t>::alias(whole.vert_corner)), face_src(Array<int32_t>::alias(whole.face_src)),
      cut_slots(Array<CutSlot>::alias(whole.cut_slots)), vert_root(Array<int32_t>::alias(whole.vert_root)),
      copy_of(Array<int32_t>::alias(whole.copy_of)), carriers(Array<Carrier>::alias(whole.carriers)),
      carrier_splits(Array<int32_t>::alias(whole.carrier_splits)),
      split_vertices(Array<SplitVertex>::alias(whole.split_vertices)), pins(Array<int32_t>::alias(whole.pins)),
      kept_bits(whole.kept_bits), first_copy(whole.first_copy), first_split(whole.first_split), changes_(whole.pos.memory()),
      changed_bits_(whole.pos.memory()), changed_slots_(whole.pos.memory()), new_verts_(whole.pos.memory()),
      new_faces_(whole.pos.memory()), new_carriers_(whole.pos.memory()), number_(number) {}

void Surface::swap_log(TrialLog& log) {
    std::swap(changes_, log.changes_);
    std::swap(changed_bits_, log.changed_bits_);
}

void Surface::reserve_freed(int64_t verts) {
    const auto reserve = [](Numbers& numbers, int64_t count) {
        const int64_t most = 2 * numbers.supplied + 16; // in a later turn, numbers that earlier parts gave out come back too
        numbers.again.reserve(std::min(numbers.again.size() + count, most));
        numbers.freed.reserve(256);
    };
    reserve(new_verts_, verts);
    reserve(new_faces_, 2 * verts);
    reserve(new_carriers_, verts);
}

void Surface::refresh(Surface& whole, const uint8_t* owner) {
    pos = Array<Vec3>::alias(whole.pos);
    corner_vert = Array<int32_t>::alias(whole.corner_vert);
    corner_twin = Array<int32_t>::alias(whole.corner_twin);
    corner_bits = Array<EdgeBits>::alias(whole.corner_bits);
    vert_corner = Array<int32_t>::alias(whole.vert_corner);
    face_src = Array<int32_t>::alias(whole.face_src);
    vert_root = Array<int32_t>::alias(whole.vert_root);
    carriers = Array<Carrier>::alias(whole.carriers);
    carrier_splits = Array<int32_t>::alias(whole.carrier_splits);
    split_vertices = Array<SplitVertex>::alias(whole.split_vertices);
    pins = Array<int32_t>::alias(whole.pins);
    owner_ = owner;
}

void Surface::supply(const Supply& more) {
    const auto add = [](Numbers& numbers, const Range& range) {
        while (numbers.range.next < numbers.range.end) numbers.again.push_back(--numbers.range.end);
        numbers.range = range;
        numbers.supplied += range.size();
    };
    add(new_verts_, more.verts);
    add(new_faces_, more.faces);
    add(new_carriers_, more.carriers);
}

bool Surface::has_room() const {
    if (!is_part()) return true;
    constexpr int64_t kOneEdit = 64; // more than a split or a flip overwrites
    const auto may_free = [](const Numbers& numbers, int64_t count) {
        return numbers.freed.room() >= count && numbers.again.room() >= numbers.freed.size() + count;
    };
    return new_verts_.range.next < new_verts_.range.end && new_faces_.room() >= 2 && new_carriers_.room() >= 1 &&
           may_free(new_verts_, 1) && may_free(new_faces_, 2) && may_free(new_carriers_, 1) &&
           (!in_trial_ || (changes_.room() >= kOneEdit && changed_bits_.room() >= kOneEdit));
}

Surface::Supply Surface::grow_blank(int32_t verts, int32_t faces_count, int32_t carriers_count) {
    const int32_t carriers_before = static_cast<int32_t>(carriers.size());
    const Supply share{
        {vertices(), vertices() + verts}, {faces(), faces() + faces_count}, {carriers_before, carriers_before + carriers_count}};
    resize_all(share.verts.end, share.faces.end, share.carriers.end);
    for (int32_t v = share.verts.next; v < share.verts.end; ++v) {
        pos[v] = {0, 0, 0};
        vert_corner[v] = -1;
        split_vertices[v - first_split] = {-1, 0, {0, 0, 0}, 0};
        pins[v - first_split] = 0;
        if (!vert_root.empty()) vert_root[v] = v;
    }
    for (int32_t c = 3 * share.faces.next; c < 3 * share.faces.end; ++c) {
        corner_vert[c] = -1;
        corner_twin[c] = kBoundary;
        corner_bits[c] = 0;
    }
    for (int32_t f = share.faces.next; f < share.faces.end; ++f) face_src[f] = 0;
    for (int32_t k = share.carriers.next; k < share.carriers.end; ++k) carriers[k] = {-1, -1}, carrier_splits[k] = 0;
    dead_faces += faces_count;
    return share;
}

void Surface::take_back(Surface& part) {
    const auto take = [](Numbers& to, Numbers& from) {
        for (int32_t n = from.range.end - 1; n >= from.range.next; --n) to.again.push_back(n); // the smallest is used first
        for (const int32_t n : from.again) to.again.push_back(n);
        from.range.next = from.range.end;
        from.again.free_storage();
    };
    take(new_verts_, part.new_verts_);
    take(new_faces_, part.new_faces_);
    take(new_carriers_, part.new_carriers_);
    dead_faces += part.dead_faces;
    part.dead_faces = 0;
}

void Surface::split_everywhere(int32_t c, const Vec3& position, SplitVertex where, Array<int32_t>& pieces) {
    pieces.clear();
    if (!is_cut(corner_twin[c])) {
        const int32_t s = add_vertex(position, where, -1);
        split(c, s);
        pieces.push_back(c);
        return;
    }
    const int32_t start_root = root(corner_vert[c]);
    const int32_t first_slot = cut_slot(corner_twin[c]);
    int32_t made_root = -1, slot = first_slot, last_new = -1, first_new = -1;
    do {
        const int32_t k = cut_slots[slot].corner;
        const bool same_way = root(corner_vert[k]) == start_root;
        // Each sheet has vertices of its own, so a carrier of its own (made once, kept by its first split vertex).
        SplitVertex here = where;
        if (k != c) {
            double t0, t1;
            const int32_t x = corner_vert[k], y = head(k);
            here.carrier = carrier_of(x, y, t0, t1);
            const bool from_a = root(carriers[where.carrier].a) == root(carriers[here.carrier].a);
            here.t = from_a ? where.t : 1 - where.t;
        }
        const int32_t s = add_vertex(position, here, made_root);
        if (made_root < 0) made_root = s;
        const int32_t tail = split(k, s);
        pieces.push_back(k);
        const int32_t near = same_way ? k : tail, far = same_way ? tail : k;
        const int32_t fresh = static_cast<int32_t>(cut_slots.size());
        cut_slots.push_back({far, -1});
        cut_slots[slot].corner = near;
        corner_twin[near] = cut_twin(slot);
        corner_twin[far] = cut_twin(fresh);
        if (last_new >= 0)
            cut_slots[last_new].next = fresh;
        else
            first_new = fresh;
        last_new = fresh;
        slot = cut_slots[slot].next;
    } while (slot != first_slot);
    cut_slots[last_new].next = first_new;
}

bool Surface::collapse_is_legal(int32_t c) const {
    const int32_t t = corner_twin[c];
    const int32_t p = corner_vert[c], q = head(c), u = apex(c), v = t >= 0 ? apex(t) : -1;
    if (u == v) return false;                                     // two faces back to back
    if (t >= 0 && on_boundary(p) && on_boundary(q)) return false; // would pinch the boundary
    // Link condition: p and q have no common neighbour but u and v, and no common link edge u v.
    int32_t common = 0, edges = 0;
    const auto look = [&](int32_t x) {
        if (x == p)
            ++edges;
        else if (adjacent(p, x))
            ++common;
    };
    const int32_t start = vert_corner[q];
    int32_t k = start;
    do {
        look(head(k));
        const int32_t last = prev_corner(k);
        k = corner_twin[last];
        if (k < 0) look(corner_vert[last]);
    } while (k >= 0 && k != start);
    if (edges != 1) return false; // pieces of faces that lie back to back may share more than one
    if (common != (t >= 0 ? 2 : 1)) return false;
    if (t >= 0 && has_face(p, u, v) && has_face(q, u, v)) return false;                            // a tetrahedron
    if (t < 0 && corner_twin[next_corner(c)] < 0 && corner_twin[prev_corner(c)] < 0) return false; // a lone triangle
    return true;
}

void Surface::kill_face(int32_t face) {
    for (int32_t k = 0; k < 3; ++k) put(&Surface::corner_vert, 3 * face + k, -1);
    ++dead_faces;
}

void Surface::drop_from_ring(int32_t c) {
    if (!is_cut(corner_twin[c])) return;
    const int32_t gone = cut_slot(corner_twin[c]);
    int32_t before = gone;
    while (cut_slots[before].next != gone) before = cut_slots[before].next;
    cut_slots[before].next = cut_slots[gone].next;
    cut_slots[gone] = {-1, gone};
    corner_twin[c] = kBoundary;
}

void Surface::unite(int32_t a, int32_t b) {
    if (vert_root.empty() || !(pos[a] == pos[b])) return;
    const int32_t ra = root(a), rb = root(b);
    vert_root[ra < rb ? rb : ra] = ra < rb ? ra : rb;
}

void Surface::collapse(int32_t c) {
    const int32_t t = corner_twin[c];
    const int32_t p = corner_vert[c], q = head(c);
    int32_t open[3], open_count = 0; // those of p and the apexes that are on the boundary, and stay there
    if (on_boundary(p) || on_boundary(q)) open[open_count++] = p;
    // All of q's corners become p's.
    const int32_t start = vert_corner[q];
    int32_t k = start;
    do {
        put(&Surface::corner_vert, k, p);
        k = rotate(k);
    } while (k >= 0 && k != start);
    // Zip the two other edges of each face of the edge together.
    int32_t sides[2] = {c, t};
    int32_t p_corner = -1;
    for (const int32_t side : sides) {
        if (side < 0) continue;
        const int32_t a = next_corner(side), b = prev_corner(side);
        const int32_t w = corner_vert[b];
        if (on_boundary(w)) open[open_count++] = w;
        int32_t ta = corner_twin[a], tb = corner_twin[b];
        const EdgeBits bits = corner_bits[a] | corner_bits[b];
        drop_from_ring(side);
        if (ta >= 0 && tb >= 0)
            set_twin(ta, tb);
        else if (ta >= 0)
            set_twin(ta, tb); // what was beyond b (boundary, or a slot) is now beyond a's neighbour
        else if (tb >= 0)
            set_twin(tb, ta);
        else {
            drop_from_ring(a);
            drop_from_ring(b);
        }
        if (ta >= 0) put_bits(ta, corner_bits[ta] | bits);
        if (tb >= 0) put_bits(tb, corner_bits[tb] | bits);
        // ta starts at w, tb ends there: outgoing corners of w and of p that stay.
        const int32_t at_w = ta >= 0 ? ta : tb >= 0 ? next_corner(tb) : -1;
        if (vert_corner[w] == b || vert_corner[w] == a || at_w < 0) put(&Surface::vert_corner, w, at_w);
        if (tb >= 0)
            p_corner = tb;
        else if (ta >= 0)
            p_corner = next_corner(ta);
        kill_face(face_of(side));
    }
    put(&Surface::vert_corner, q, -1);
    put(&Surface::vert_corner, p, p_corner);
    unite(p, q);
    // Boundary vertices keep their boundary corner.
    for (int i = 0; i < open_count; ++i) {
        const int32_t x = open[i], first = vert_corner[x];
        if (first < 0) continue;
        int32_t m = first;
        for (;;) { // clockwise: outgoing corner before m is next(twin(m))
            const int32_t beyond = corner_twin[m];
            if (beyond < 0) break;
            m = next_corner(beyond);
            if (m == first) break;
        }
        if (m != first) put(&Surface::vert_corner, x, m);
    }
}

void Surface::gather_corners(int32_t v, Array<int32_t>& out) const {
    const int32_t start = vert_corner[v];
    if (start < 0) return;
    int32_t c = start;
    do {
        out.push_back(c);
        c = rotate(c);
    } while (c >= 0 && c != start);
}

void Surface::separate_fans(int32_t v, const Array<int32_t>& corners_of_v) {
    vert_corner[v] = -1;
    bool first = true;
    for (const int32_t seed : corners_of_v) {
        if (corner_vert[seed] != v) continue; // in a fan that already went to a copy, or in a removed face
        if (!first && vert_corner[v] >= 0) {
            bool seen = false; // in the fan that keeps v?
            int32_t k = vert_corner[v];
            do {
                seen |= k == seed;
                k = rotate(k);
            } while (k >= 0 && k != vert_corner[v] && !seen);
            if (seen) continue;
        }
        int32_t start = seed; // the boundary corner of an open fan, else the seed
        while (corner_twin[start] >= 0) {
            start = next_corner(corner_twin[start]);
            if (start == seed) break;
        }
        if (first) {
            vert_corner[v] = start;
            first = false;
            continue;
        }
        add_copy(v, start);
    }
}

void Surface::add_copy(int32_t v, int32_t start) {
    int32_t copy = vertices();
    if (split_vertices.empty()) { // a repair's
        pos.push_back(pos[v]);
        vert_corner.push_back(-1);
        copy_of.push_back(v);
        if (!vert_root.empty()) vert_root.push_back(vert_root[v]);
        first_split = vertices();
    } else {
        SplitVertex where;
        if (is_original(v)) {
            where = {add_carrier(v, head(start)), 0, pos[v], 0};
        } else
            where = split_vertices[v - first_split];
        copy = append_vertex(pos[v], where, vert_root.empty() ? -1 : vert_root[v]);
    }
    const int32_t kept = vert_corner[v];
    vert_corner[v] = start;
    rename(v, copy);
    vert_corner[v] = kept;
}

bool Surface::collapse_and_cut(int32_t c) {
    const int32_t t = corner_twin[c];
    const int32_t p = corner_vert[c], q = head(c), u = apex(c), v = t >= 0 ? apex(t) : -1;
    if (u == v) { // two faces back to back: gone altogether, if that is all there is of them
        const int32_t g = face_of(t);
        const int32_t a = corner_twin[next_corner(c)], b = corner_twin[prev_corner(c)];
        if (a < 0 || b < 0 || face_of(a) != g || face_of(b) != g) return false;
        kill_face(face_of(c));
        kill_face(g);
        vert_corner[p] = vert_corner[q] = vert_corner[u] = -1;
        return true;
    }
    Array<int32_t> ring(pos.memory());   // p's and q's corners
    Array<int32_t> around(pos.memory()); // the corners of the vertex at hand
    Array<int32_t> others(pos.memory()); // vertices whose fans may come apart
    Array<int32_t> loops(pos.memory());  // pairs of corners p -> x, q -> x
    gather_corners(p, ring);
    const int64_t of_p = ring.size();
    gather_corners(q, ring);
    const auto all_different = [&](int64_t begin, int64_t end) { // edges of one vertex lead to different vertices
        others.clear();
        for (int64_t i = begin; i < end; ++i) others.push_back(head(ring[i]));
        std::sort(others.begin(), others.end());
        return std::adjacent_find(others.begin(), others.end()) == others.end();
    };
    if (!all_different(0, of_p) || !all_different(of_p, ring.size())) return false;
    others.clear();
    for (int64_t i = 0; i < ring.size(); ++i) others.push_back(head(ring[i]));
    for (int64_t i = 0; i < ring.size(); ++i) others.push_back(apex(ring[i])); // the last neighbour of an open fan
    for (int64_t i = 0; i < of_p; ++i) {
        const int32_t x = head(ring[i]);
        if (x == q || x == u || x == v) continue;
        for (int64_t k = of_p; k < ring.size(); ++k) {
            if (head(ring[k]) != x) continue;
            if (corner_twin[ring[i]] < 0 || corner_twin[ring[k]] < 0) return false;
            loops.push_back(ring[i]);
            loops.push_back(ring[k]);
        }
        // An open fan's last edge arrives, so a corner q -> x may be missing: then the loop's side is a boundary.
    }
    for (const int32_t k : ring)
        if (corner_twin[prev_corner(k)] < 0) {
            const int32_t x = corner_vert[prev_corner(k)];
            const bool other_side = corner_vert[k] == p;
            for (int64_t i = other_side ? of_p : 0; i < (other_side ? ring.size() : of_p); ++i)
                if (x != u && x != v && x != q && x != p && head(ring[i]) == x) return false;
        }
    // Corners of everything near, before anything changes.
    Array<int32_t> near(pos.memory());
    Array<int64_t> first_of(pos.memory());
    std::sort(others.begin(), others.end());
    others.resize_uninitialized(std::unique(others.begin(), others.end()) - others.begin());
    for (const int32_t x : others) {
        first_of.push_back(near.size());
        if (x != p && x != q) gather_corners(x, near);
    }
    first_of.push_back(near.size());
    collapse(c);
    for (int64_t i = 0; i < loops.size(); i += 2) {
        const int32_t a = loops[i], b = loops[i + 1];
        const int32_t ta = corner_twin[a], tb = corner_twin[b];
        set_twin(a, tb);
        set_twin(b, ta);
        corner_bits[a] = corner_bits[tb] = corner_bits[b] = corner_bits[ta] = corner_bits[a] | corner_bits[b];
    }
    separate_fans(p, ring);
    for (int64_t i = 0; i < others.size(); ++i) {
        if (others[i] == p || others[i] == q) continue;
        around.clear();
        for (int64_t k = first_of[i]; k < first_of[i + 1]; ++k) around.push_back(near[k]);
        separate_fans(others[i], around);
    }
    return true;
}

void Surface::remove_boundary_face(int32_t c) {
    const int32_t face = face_of(c);
    const int32_t v[3] = {corner_vert[c], head(c), apex(c)};
    for (int i = 0; i < 3; ++i) {
        const int32_t k = 3 * face + i;
        if (corner_twin[k] >= 0)
            corner_twin[corner_twin[k]] = kBoundary;
        else
            drop_from_ring(k);
    }
    int32_t beyond[3];
    for (int i = 0; i < 3; ++i) beyond[i] = corner_twin[3 * face + i];
    kill_face(face);
    // Each vertex may have up to two fans left, one on either side of the face.
    for (const int32_t x : v) {
        int32_t fan[2];
        int fans = 0;
        for (int i = 0; i < 3; ++i) {
            if (beyond[i] < 0) continue;
            const int32_t k = beyond[i];
            if (corner_vert[k] == x)
                fan[fans++] = k;            // boundary edge leaving x
            else if (head(k) == x) {        // boundary edge arriving at x
                int32_t m = next_corner(k); // last of its fan, go clockwise
                while (corner_twin[m] >= 0) m = next_corner(corner_twin[m]);
                fan[fans++] = m;
            }
        }
        if (fans == 2 && fan[0] == fan[1]) fans = 1;
        if (fans == 0) {
            // Only the face's boundary sides touched x here; was there more of x elsewhere?
            if (vert_corner[x] >= 0 && face_of(vert_corner[x]) == face) vert_corner[x] = -1;
            continue;
        }
        vert_corner[x] = fan[0];
        if (fans == 2) add_copy(x, fan[1]);
    }
}

void Surface::rename(int32_t v, int32_t heir) {
    const int32_t start = vert_corner[v];
    int32_t k = start;
    do {
        corner_vert[k] = heir;
        k = rotate(k);
    } while (k >= 0 && k != start);
    vert_corner[heir] = start;
    vert_corner[v] = -1;
}

void Surface::remove_component(const Array<int32_t>& faces_of_it) {
    for (const int32_t f : faces_of_it) {
        for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
            drop_from_ring(c);
            put(&Surface::vert_corner, corner_vert[c], -1);
        }
    }
    for (const int32_t f : faces_of_it) kill_face(f);
}

bool Surface::valid() const {
    const auto check = [](bool holds) {
        DM_ASSERT(holds);
        return holds;
    };
    for (int32_t c = 0; c < corners(); ++c) {
        if (is_dead(face_of(c))) continue;
        const int32_t t = corner_twin[c], v = corner_vert[c];
        if (!check(v >= 0 && v < vertices())) return false;
        if (!check(v != head(c))) return false;
        if (t >= 0) {
            if (!check(t < corners() && !is_dead(face_of(t)) && corner_twin[t] == c)) return false;
            if (!check(corner_vert[t] == head(c) && head(t) == v)) return false;
            if (!check(corner_bits[t] == corner_bits[c])) return false;
        } else if (is_cut(t)) {
            if (!check(cut_slots[cut_slot(t)].corner == c)) return false;
        }
        if (!check(vert_corner[v] >= 0 && corner_vert[vert_corner[v]] == v)) return false;
        if (t < 0 && !check(vert_corner[v] == c)) return false;
    }
    for (int32_t v = 0; v < vertices(); ++v) {
        const int32_t start = vert_corner[v];
        if (start < 0) continue;
        int32_t c = start, steps = 0;
        do {
            if (!check(corner_vert[c] == v && ++steps <= corners())) return false;
            c = rotate(c);
        } while (c >= 0 && c != start);
    }
    return true;
}

} // namespace dm
