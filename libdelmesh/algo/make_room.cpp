// SPDX-License-Identifier: Apache-2.0
// What the loop does where no representable point lies between the ends of an edge that must be split: what is smaller than the
// precision is flipped, merged or taken out. Clean meshes never come here.
#include "algo/loop.h"

#include <algorithm>

#include "geom/predicates.h"

namespace dm {
namespace {

// In units in the last place. Where the precision has no room to split an edge, edges up to kShort may be taken out, vertices
// closer than kMelt become one, and the surface may move by rules.need in all (the report says by how much it did); clean meshes
// get by with the tolerance.
constexpr double kMelt = 4, kShort = 16;

} // namespace

// No representable point lies between the ends of c: what is smaller than the precision is flipped or taken out.
bool Loop::make_room(int32_t c) {
    in_need = true;
    const bool done = s.is_boundary(c) ? remove_ears(c) || collapse(c) : make_room_inside(c);
    in_need = false;
    return done;
}

bool Loop::make_room_inside(int32_t c) {
    const int32_t t = s.twin(c);
    if (s.at(s.apex(c)) == s.at(s.apex(t))) { // the flip would make an edge of zero length
        if (merge_apexes(c)) return true;
    } else if (const Judgement judgement = judge(c); judgement.verdict == Verdict::flip) {
        do_flip(c, judgement.free);
        return true;
    }
    return melt(c);
}

// Split vertices on different lines crowd where these lines meet at a small angle, closer than the precision can tell apart.
// All that is connected within a few units in the last place around c becomes one vertex: the displacement counts once.
bool Loop::melt(int32_t c) {
    const int32_t ends[2] = {s.vert(c), s.head(c)};
    const double reach = std::max(length(s.at(ends[1]) - s.at(ends[0])), kMelt * rules.resolution);
    if (reach > kShort * rules.resolution) return false;
    // A vertex of the input never moves, nor one at the boundary, whose copies would have to follow: there may only be one.
    cluster.clear();
    int32_t anchor = -1;
    const auto add = [&](int32_t v) {
        if (length(s.at(v) - s.at(ends[0])) > reach || std::find(cluster.begin(), cluster.end(), v) != cluster.end()) return;
        const bool anchored = s.is_original(v) || s.on_boundary(v);
        if (anchored && anchor >= 0) return;
        if (anchored) anchor = v;
        cluster.push_back(v);
    };
    add(ends[0]);
    add(ends[1]);
    if (cluster.size() < 2) return collapse(c);
    around.clear(); // faces of the cluster
    for (int64_t i = 0; i < cluster.size(); ++i) {
        const int32_t start = s.vert_corner[cluster[i]];
        for (int32_t k = start;;) {
            add(s.head(k));
            around.push_back(face_of(k));
            k = s.rotate(k);
            if (k < 0 || k == start) break;
        }
    }
    std::sort(around.begin(), around.end());
    around.resize_uninitialized(std::unique(around.begin(), around.end()) - around.begin());
    const int32_t stays = anchor >= 0 ? anchor : *std::min_element(cluster.begin(), cluster.end());
    const Vec3 place = s.at(stays);
    double moved = 0, shift = 0;
    for (const int32_t v : cluster) shift = std::max(shift, length(s.at(v) - place));
    if (patches != nullptr) {
        for (const int32_t f : around) moved = std::max(moved, patches->moved(f));
        moved += shift;
        if (!(moved <= rules.need)) return false;
    }
    places.clear();
    for (const int32_t v : cluster) {
        places.push_back(s.at(v));
        s.pos[v] = place;
    }
    const int32_t first_copy = s.vertices();
    int64_t merged = 0;
    for (bool again = true; again;) {
        again = false;
        for (const int32_t f : around)
            for (int32_t k = 3 * f; k < 3 * f + 3 && !s.is_dead(f); ++k) {
                const int32_t t = s.twin(k), a = s.vert(k), b = s.head(k);
                if (t < 0 || !(s.at(a) == s.at(b))) continue;
                const bool first = s.on_boundary(a) != s.on_boundary(b) ? s.on_boundary(a) : a < b;
                const int32_t from = first ? k : t;
                if (s.collapse_is_legal(from))
                    s.collapse(from);
                else if (!s.collapse_and_cut(from))
                    continue;
                ++merged;
                again = true;
            }
    }
    report.collapsed_edges += merged;
    for (int64_t i = 0; i < cluster.size(); ++i) // a vertex of the input that nothing uses any more is handed out as it was
        if (s.vert_corner[cluster[i]] < 0) s.pos[cluster[i]] = places[i];
    if (patches != nullptr)
        for (const int32_t f : around) {
            if (!s.is_dead(f)) patches->own(s, f, moved);
        }
    drop_bubbles(place);
    look_at_changed(first_copy);
    return merged != 0;
}

// The faces in `around`, and those of copies that cuts made: entries in the queues do not know their new vertices.
void Loop::look_at_changed(int32_t first_copy) {
    for (const int32_t f : around)
        if (!s.is_dead(f)) look_at_face(f);
    for (int32_t v = first_copy; v < s.vertices(); ++v)
        if (s.vert_corner[v] >= 0) look_at_faces_of(v);
}
// Two faces back to back: their apexes become one vertex and the faces vanish. Where the apexes have further common
// neighbours the surface is a pocket of zero width there; it is cut off, and goes if it is smaller than the precision.
bool Loop::merge_apexes(int32_t c) {
    const int32_t u = s.apex(c), v = s.apex(s.twin(c));
    const Judgement judgement = judge(c);
    if (judgement.verdict != Verdict::flip) return false;
    around.clear();
    for (const int32_t x : {u, v}) {
        int32_t k = s.vert_corner[x];
        do {
            around.push_back(face_of(k));
            k = s.rotate(k);
        } while (k >= 0 && k != s.vert_corner[x]);
    }
    const Vec3 place = s.at(u);
    do_flip(c, judgement.free);
    const int32_t made = next_corner(c), back = s.twin(made);
    const int32_t from = s.vert(made) < s.head(made) ? made : back; // the younger vertex goes
    const double gone = patches != nullptr ? patches->moved(face_of(made)) : 0;
    for (const int32_t k : {made, back}) {
        raise_beyond(next_corner(k), gone);
        raise_beyond(prev_corner(k), gone);
    }
    const int32_t first_copy = s.vertices();
    // Where neither goes, at a boundary, the flip stands: further ones may take the edge of zero length away again, and the
    // certificate has the last word.
    const bool legal = s.collapse_is_legal(from);
    if (legal) s.collapse(from);
    if (legal || s.collapse_and_cut(from)) ++report.collapsed_edges;
    drop_bubbles(place);
    look_at_changed(first_copy);
    return true;
}

// Of the components that the faces in `around` belong to, removes those that fit into a few units in the last place, and
// those of two faces back to back.
void Loop::drop_bubbles(const Vec3& place) {
    constexpr int64_t kMost = 64;
    double extent = 0;
    for (const int32_t seed : around) {
        if (s.is_dead(seed)) continue;
        bubble.clear();
        bubble.push_back(seed);
        double reach = 0;
        for (int64_t i = 0; i < bubble.size() && bubble.size() <= kMost; ++i)
            for (int32_t k = 3 * bubble[i]; k < 3 * bubble[i] + 3; ++k) {
                reach = std::max(reach, length(s.at(s.vert(k)) - place));
                if (s.is_boundary(k)) continue;
                const int32_t g = face_of(s.twin(k));
                if (std::find(bubble.begin(), bubble.end(), g) == bubble.end()) bubble.push_back(g);
            }
        if (bubble.size() > kMost || bubble.size() == s.faces() - s.dead_faces) continue;
        double moved = 0;
        if (patches != nullptr)
            for (const int32_t f : bubble) moved = std::max(moved, patches->moved(f));
        if (reach <= kShort * rules.resolution)
            extent = std::max(extent, moved + reach);
        else if (bubble.size() != 2 || !is_covered(moved))
            continue;
        report.removed_zero_area_faces += bubble.size();
        s.remove_component(bubble);
    }
    for (const int32_t f : around) // what is left there is within the extent of what was removed
        if (!s.is_dead(f)) raise(f, extent);
}

// Two faces back to back in `bubble`: is their longest side also one of another face in `around`, which can stand for them?
bool Loop::is_covered(double moved) {
    if (patches == nullptr) return true;
    int32_t side = 3 * bubble[0];
    double longest = 0;
    for (int32_t k = side; k < 3 * bubble[0] + 3; ++k) {
        const double size = length(s.at(s.head(k)) - s.at(s.vert(k)));
        if (size > longest) longest = size, side = k;
    }
    const Vec3 &a = s.at(s.vert(side)), &b = s.at(s.head(side));
    moved += distance_to_segment(s.at(s.apex(side)), a, b);
    if (!(moved <= rules.need)) return false;
    for (const int32_t f : around) {
        if (s.is_dead(f) || f == bubble[0] || f == bubble[1]) continue;
        for (int32_t k = 3 * f; k < 3 * f + 3; ++k)
            if ((s.at(s.vert(k)) == a && s.at(s.head(k)) == b) || (s.at(s.vert(k)) == b && s.at(s.head(k)) == a)) {
                raise(f, moved);
                return true;
            }
    }
    return false;
}

// Where copies of the edge share its split vertices, the face in the way may be another one's.
bool Loop::remove_ears(int32_t c) {
    if (remove_ear(c)) return true;
    if (!is_cut(s.twin(c))) return false;
    const int32_t start = cut_slot(s.twin(c));
    for (int32_t slot = s.cut_slots[start].next; slot != start; slot = s.cut_slots[slot].next) {
        const int32_t k = s.cut_slots[slot].corner;
        if (!remove_ear(k)) continue;
        look_at(c);
        return true;
    }
    return false;
}

// A face at the boundary that is flat within the precision: it goes, and its other edges become the boundary.
bool Loop::remove_ear(int32_t c) {
    const double height = distance_to_segment(s.at(s.apex(c)), s.at(s.vert(c)), s.at(s.head(c)));
    if (!(height <= rules.resolution) || (s.corner_bits[c] & s.kept_bits & kEdgeGiven) != 0) return false;
    const int32_t f = face_of(c), n = s.twin(next_corner(c)), p = s.twin(prev_corner(c));
    if (patches != nullptr) {
        // Either its one long side is still covered by a copy, or its two others by what is there.
        const bool long_side = is_cut(s.twin(c)) && s.cut_slots[cut_slot(s.twin(c))].next != cut_slot(s.twin(c));
        const auto covered = [](int32_t twin) { return twin >= 0 || is_cut(twin); };
        if (!long_side && !(covered(n) && covered(p))) return false;
        const double moved = patches->moved(f) + height;
        if (!(moved <= rules.need)) return false;
        for (int32_t k = 3 * f; k < 3 * f + 3; ++k) raise_beyond(k, moved);
    }
    const int32_t first_copy = s.vertices();
    around.clear();
    for (const int32_t k : {n, p})
        if (k >= 0) around.push_back(face_of(k));
    s.remove_boundary_face(c);
    ++report.removed_zero_area_faces;
    look_at_changed(first_copy);
    return true;
}

// The face has come to stand for a part of the surface that is up to `moved` away from it.
void Loop::raise(int32_t face, double moved) {
    if (patches != nullptr) patches->raise(face, moved);
}
void Loop::raise_beyond(int32_t c, double moved) {
    const int32_t t = s.twin(c);
    if (t >= 0) raise(face_of(t), moved);
    if (!is_cut(t)) return;
    for (int32_t slot = s.cut_slots[cut_slot(t)].next; slot != cut_slot(t); slot = s.cut_slots[slot].next)
        raise(face_of(s.cut_slots[slot].corner), moved);
}

// Merges the ends of a very short edge, if that keeps the topology, leaves no face without area, and the tolerance allows it.
bool Loop::collapse(int32_t c) {
    const double size = length(s.at(s.head(c)) - s.at(s.vert(c)));
    if (size > kShort * rules.resolution) return false;
    const int32_t t = s.twin(c);
    // The younger vertex goes: a split vertex rather than one of the input's.
    const int32_t keeps_first = s.vert(c) < s.head(c) || t < 0 ? c : t;
    const int32_t stays = s.vert(keeps_first), goes = s.head(keeps_first);
    if (s.is_original(goes) && t < 0) return false;
    if (!s.collapse_is_legal(keeps_first)) return false;
    around.clear(); // faces of the vertex that goes
    const int32_t start = s.vert_corner[goes];
    for (int32_t k = start;;) {
        if (is_cut(s.twin(k)) || is_cut(s.twin(prev_corner(k)))) return false; // its copies would have to follow
        if (patches != nullptr && !(patches->moved(face_of(k)) + size <= rules.need)) return false;
        const int32_t x = s.head(k), y = s.apex(k);
        if (x != stays && y != stays && zero_area(s.at(stays), s.at(x), s.at(y))) return false;
        around.push_back(face_of(k));
        k = s.rotate(k);
        if (k < 0 || k == start) break;
    }
    if (patches != nullptr) {
        for (const int32_t f : around) patches->raise(f, patches->moved(f) + size);
        for (const int32_t k : {c, t}) {
            if (k < 0) continue;
            raise_beyond(next_corner(k), patches->moved(face_of(k)));
            raise_beyond(prev_corner(k), patches->moved(face_of(k)));
        }
    }
    s.collapse(keeps_first);
    ++report.collapsed_edges;
    if (patches != nullptr)
        for (const int32_t f : around)
            if (!s.is_dead(f)) patches->own(s, f, patches->moved(f));
    look_at_faces_of(stays);
    return true;
}

} // namespace dm
