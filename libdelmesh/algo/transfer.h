// SPDX-License-Identifier: Apache-2.0
// Carries layers of the source over to a mesh that was made from it, through the mesh's maps (docs/attributes.md). The views were
// checked by api/: they have strides, and as many elements as the source and the mesh.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// domain, policy: of delmesh.h; types and components of both views are the same.
Status transfer(Context& context, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                const delmesh_view_mut& target);

// Sparse vertex layers, in two steps, so that whether there is room is known before anything is written.
class SparseTransfer {
public:
    struct Entry {
        int64_t index;
        double value;
    };

    SparseTransfer(Context& context, const Mesh& mesh)
        : context_(context), mesh_(mesh), source_offsets_(context.memory()), source_(context.memory()),
          offsets_(context.memory()), places_(context.memory()), scratch_(context.memory()) {}

    // Copies the source, checked entry by entry, and counts how many entries each vertex will have.
    Status count(const delmesh_rows& source, int32_t limit);
    int64_t entries() const { return offsets_.back(); }
    int64_t largest_index() const { return largest_index_; } // of the source; -1 where it has no entry
    // Indices and values only where they are given.
    Status write(int32_t normalise, const delmesh_rows_mut& target);

private:
    // The source rows of a vertex, each with its weight; those without weight or entries left out.
    struct Rows {
        int32_t count = 0;
        struct {
            const Entry *at, *end;
            double weight;
        } of[3];
    };

    Status read_offsets(const delmesh_view& offsets, int64_t entries);
    Status read_entries(const delmesh_view& indices, const delmesh_view& values);
    Status sort_rows();
    Rows rows_of(int32_t v) const;
    template <class Use>
    static void merge(Rows rows, Use&& use); // use(Entry), ascending by index, without those that are 0
    int64_t gather(int32_t v, int32_t normalise, Entry* out) const;
    int64_t most_entries(int32_t v) const; // before those of one index are added up
    Status make_scratch();
    Status write_offsets(const delmesh_view_mut& target);
    template <class Index, class Value>
    Status write_rows(int32_t normalise, const delmesh_rows_mut& target);

    Context& context_;
    const Mesh& mesh_;
    Array<int64_t> source_offsets_;
    Array<Entry> source_;    // row by row, ascending by index
    Array<int64_t> offsets_; // of the result, V + 1
    Array<int64_t> places_;  // of a piece's vertices in the scratch
    Array<Entry> scratch_;   // the merged rows of a piece
    int64_t largest_index_ = -1;
    int32_t limit_ = 0;
    double rounding_ = 0; // of the source's type: a sum that differs from 1 by no more is 1
};

} // namespace dm
