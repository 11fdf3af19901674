// SPDX-License-Identifier: Apache-2.0
// The elements of a mesh by the face of the cage that they lie on.
#pragma once

#include "mesh/source_map.h"
#include "mesh/views.h"
#include "subdiv/faces.h"

namespace dm {

class PlaceOrder {
public:
    explicit PlaceOrder(Memory& memory) : first_(memory), items_(memory) {}

    // face_of(i): the cage's face of element i, or -1 for none.
    template <class FaceOf>
    Status build(Context& context, const Cage& cage, int64_t count, FaceOf&& face_of) {
        first_.assign(int64_t{cage.faces()} + 1, 0);
        bool sorted = true;
        int32_t last = 0;
        DM_TRY(in_pieces(context, count, 0, 0.1, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t i = begin; i < end; ++i) {
                const int32_t f = face_of(i);
                sorted &= f >= last;
                if (f < 0) continue;
                last = f;
                if (cage.has_limit[f] == 0)
                    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                        "The argument 'mesh' lay on face %d, where 'cage' has no limit.", f);
                ++first_[f + 1];
            }
            return DELMESH_OK;
        }));
        for (int32_t f = 0; f < cage.faces(); ++f) first_[f + 1] += first_[f];
        if (sorted) return DELMESH_OK;
        items_.resize_uninitialized(first_.back());
        Array<int64_t> at(context.memory());
        at.copy_from(first_);
        return in_pieces(context, count, 0.1, 0.2, [&](int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i)
                if (const int32_t f = face_of(i); f >= 0) items_[at[f]++] = static_cast<int32_t>(i);
            return DELMESH_OK;
        });
    }

    bool is_empty(int32_t f) const { return first_[f] == first_[f + 1]; }
    // use(i) for all elements of a face, ascending.
    template <class Use>
    void for_each(int32_t f, Use&& use) const {
        for (int64_t k = first_[f]; k < first_[f + 1]; ++k) use(items_.empty() ? static_cast<int32_t>(k) : items_[k]);
    }
    int64_t per_face() const { return first_.back() / (first_.size() - 1); }

private:
    Array<int64_t> first_; // per face
    Array<int32_t> items_; // empty: in order already
};

// Per vertex its first corner, whose place is the vertex's; -1: unused.
inline Status first_corners(Context& context, const Mesh& mesh, Array<int32_t>& first) {
    first.assign(mesh.vertices(), -1);
    return in_pieces(context, mesh.corners(), 0, 0, [&](int64_t begin, int64_t end) {
        for (int32_t c = static_cast<int32_t>(begin); c < end; ++c)
            if (int32_t& of = first[mesh.corner_vert[c]]; of < 0) of = c;
        return DELMESH_OK;
    });
}

} // namespace dm
