// SPDX-License-Identifier: Apache-2.0
#include "algo/transfer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "algo/parallel_slices.h"
#include "mesh/source_map.h"
#include "mesh/views.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 1 << 13;

// ---- Places -----------------------------------------------------------------------------------------------------------------

// The source elements of one of the mesh's, without those that have no weight: what they hold, be it a NaN, is then no matter.
struct Place {
    int32_t count; // 0: no source
    int32_t index[3];
    double weight[3];
};

Place single(int32_t index) {
    Place place;
    place.count = index < 0 ? 0 : 1;
    place.index[0] = index;
    place.weight[0] = 1;
    return place;
}

Place weighted(const int32_t* index, const double* weight) {
    Place place;
    place.count = 0;
    for (int k = 0; k < 3; ++k) {
        if (weight[k] == 0) continue;
        place.index[place.count] = index[k];
        place.weight[place.count++] = weight[k];
    }
    return place;
}

// The first of the largest weights: the maps name the ends of an edge in the same order on both its sides.
Place nearest_of(const Place& place) {
    int32_t best = 0;
    for (int32_t k = 1; k < place.count; ++k)
        if (place.weight[k] > place.weight[best]) best = k;
    return single(place.index[best]);
}

class Places {
public:
    Places(const Mesh& mesh, int32_t domain, bool nearest) : mesh_(mesh), domain_(domain), nearest_(nearest) {}

    int64_t count() const {
        switch (domain_) {
        case DELMESH_DOMAIN_VERTEX:
            return mesh_.vertices();
        case DELMESH_DOMAIN_CORNER:
            return mesh_.corners();
        case DELMESH_DOMAIN_FACE:
            return mesh_.faces();
        default:
            return mesh_.counts.edges;
        }
    }
    Place operator()(int64_t i) const {
        switch (domain_) {
        case DELMESH_DOMAIN_VERTEX: {
            if (mesh_.split_map.empty() || i < mesh_.first_split) return single(source_of(mesh_.vert_source, i));
            const VertexMap& map = mesh_.split_map[i - mesh_.first_split];
            return of(map.vert, map.weight);
        }
        case DELMESH_DOMAIN_CORNER: {
            const int32_t s = source_of(mesh_.corner_map, i);
            if (s >= 0) return single(s);
            const CornerPlace& place = mesh_.corner_places[~s];
            return of(place.corner, place.weight);
        }
        case DELMESH_DOMAIN_FACE:
            return single(source_of(mesh_.face_source, i));
        default:
            return single(source_of(mesh_.edge_source, i));
        }
    }

private:
    Place of(const int32_t* index, const double* weight) const {
        const Place place = weighted(index, weight);
        return nearest_ ? nearest_of(place) : place;
    }

    const Mesh& mesh_;
    int32_t domain_;
    bool nearest_;
};

// ---- Values -----------------------------------------------------------------------------------------------------------------

// What a weighted sum came to, as a T between the least and the greatest of what went into it, where it lies but for rounding:
// what is the same all over stays the same bit for bit, and no integer leaves its type. A NaN stays one.
template <class T>
T between(double sum, T least, T greatest) {
    if (sum <= static_cast<double>(least)) return least;
    if (sum >= static_cast<double>(greatest)) return greatest;
    if constexpr (std::is_integral_v<T>)
        return std::clamp(static_cast<T>(std::nearbyint(sum)), least, greatest);
    else
        return static_cast<T>(sum);
}

template <class T>
T weighted_sum(const Place& place, const T* const* from, int64_t k) {
    const T a = from[0][k], b = from[1][k];
    double sum = place.weight[0] * static_cast<double>(a) + place.weight[1] * static_cast<double>(b);
    T least = std::min(a, b), greatest = std::max(a, b);
    if (place.count == 3) {
        const T c = from[2][k];
        sum += place.weight[2] * static_cast<double>(c);
        least = std::min(least, c);
        greatest = std::max(greatest, c);
    }
    return between(sum, least, greatest);
}

// 1 / size, or 1 where that is 1 but for the rounding of a T: what has the size already is carried over bit for bit.
template <class T>
double scale_to_one(double size) {
    return std::abs(size - 1) <= static_cast<double>(std::numeric_limits<T>::epsilon()) ? 1 : 1 / size;
}

// Times the power of two that has the largest of them between 1 and 2.
void bring_to_one(double* sums, int64_t components, double largest) {
    const int exponent = std::ilogb(largest);
    for (int64_t k = 0; k < components; ++k) sums[k] = std::ldexp(sums[k], -exponent);
}

template <class T>
double direction_scale(double* sums, int64_t components) {
    double largest = 0, squares = 0;
    for (int64_t k = 0; k < components; ++k) {
        largest = std::max(largest, std::abs(sums[k]));
        squares += sums[k] * sums[k];
    }
    if (largest == 0 || !std::isfinite(largest)) return 1; // 0 stays 0
    if (squares > 1e-280 && squares < 1e280) return scale_to_one<T>(std::sqrt(squares));
    bring_to_one(sums, components, largest); // squares out of range, or nearly
    squares = 0;
    for (int64_t k = 0; k < components; ++k) squares += sums[k] * sums[k];
    return 1 / std::sqrt(squares);
}

// None of the sums is negative.
template <class T>
double weights_scale(double* sums, int64_t components) {
    double largest = 0, total = 0;
    for (int64_t k = 0; k < components; ++k) {
        largest = std::max(largest, sums[k]);
        total += sums[k];
    }
    if (largest == 0 || !std::isfinite(largest)) return 1; // 0 stays 0
    if (total >= std::numeric_limits<double>::min() && std::isfinite(total)) return scale_to_one<T>(total);
    bring_to_one(sums, components, largest); // 1 / total out of range, or the total
    total = 0;
    for (int64_t k = 0; k < components; ++k) total += sums[k];
    return 1 / total;
}

// ---- Loops ------------------------------------------------------------------------------------------------------------------

constexpr int64_t kMostComponents = 256;

// kComponents 0: as many as the view says.
template <class T, int kComponents>
Status carry_linear(Context& context, const Places& places, const delmesh_view& source, const delmesh_view_mut& target) {
    const int64_t components = kComponents != 0 ? kComponents : source.components;
    const size_t bytes = static_cast<size_t>(components) * sizeof(T);
    return parallel_slices(context, places.count(), kGrain, 0, 1, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
            const Place place = places(i);
            T* const to = element<T>(target, i);
            if (place.count == 1) {
                std::memcpy(to, element<T>(source, place.index[0]), bytes);
            } else if (place.count == 0) {
                std::memset(to, 0, bytes);
            } else {
                const T* from[3];
                for (int32_t j = 0; j < place.count; ++j) from[j] = element<T>(source, place.index[j]);
                for (int64_t k = 0; k < components; ++k) to[k] = weighted_sum(place, from, k);
            }
        }
    });
}

template <class T, int32_t kPolicy>
Status carry_normalised(Context& context, const Places& places, const delmesh_view& source, const delmesh_view_mut& target) {
    const int64_t components = source.components;
    return parallel_slices(context, places.count(), kGrain, 0, 1, [&](int64_t, int64_t begin, int64_t end) {
        double sums[kMostComponents];
        for (int64_t i = begin; i < end; ++i) {
            const Place place = places(i);
            std::fill_n(sums, components, -0.0); // which adds nothing, not even a sign
            for (int32_t j = 0; j < place.count; ++j) {
                const T* const from = element<T>(source, place.index[j]);
                for (int64_t k = 0; k < components; ++k) {
                    const double value = static_cast<double>(from[k]);
                    sums[k] += place.weight[j] * (kPolicy == DELMESH_TRANSFER_DIRECTION || value > 0 ? value : 0);
                }
            }
            const double scale = place.count == 0                        ? 0
                                 : kPolicy == DELMESH_TRANSFER_DIRECTION ? direction_scale<T>(sums, components)
                                                                         : weights_scale<T>(sums, components);
            T* const to = element<T>(target, i);
            for (int64_t k = 0; k < components; ++k) to[k] = place.count == 0 ? T(0) : static_cast<T>(sums[k] * scale);
        }
    });
}

template <class T>
Status carry(Context& context, const Places& places, int32_t policy, const delmesh_view& source, const delmesh_view_mut& target) {
    if constexpr (std::is_floating_point_v<T>) {
        if (policy == DELMESH_TRANSFER_DIRECTION)
            return carry_normalised<T, DELMESH_TRANSFER_DIRECTION>(context, places, source, target);
        if (policy == DELMESH_TRANSFER_WEIGHTS)
            return carry_normalised<T, DELMESH_TRANSFER_WEIGHTS>(context, places, source, target);
    }
    switch (source.components) { // copies of a known size are much faster
    case 1:
        return carry_linear<T, 1>(context, places, source, target);
    case 2:
        return carry_linear<T, 2>(context, places, source, target);
    case 3:
        return carry_linear<T, 3>(context, places, source, target);
    case 4:
        return carry_linear<T, 4>(context, places, source, target);
    default:
        return carry_linear<T, 0>(context, places, source, target);
    }
}

} // namespace

Status transfer(Context& context, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                const delmesh_view_mut& target) {
    const Places places(mesh, domain, policy == DELMESH_TRANSFER_NEAREST);
    DM_TRY(context.stage("transfer", 0, 1));
    switch (source.type) {
    case DELMESH_FLOAT32:
        return carry<float>(context, places, policy, source, target);
    case DELMESH_FLOAT64:
        return carry<double>(context, places, policy, source, target);
    case DELMESH_INT32:
        return carry<int32_t>(context, places, policy, source, target);
    case DELMESH_UINT32:
        return carry<uint32_t>(context, places, policy, source, target);
    case DELMESH_INT64:
        return carry<int64_t>(context, places, policy, source, target);
    default:
        return carry<uint8_t>(context, places, policy, source, target);
    }
}

// ---- Sparse -----------------------------------------------------------------------------------------------------------------

namespace {
constexpr int64_t kPiece = 1 << 14;    // vertices that share the scratch
constexpr int64_t kRowsPerBlock = 256; // of them

double value_at(const delmesh_view& values, int64_t i) {
    return values.type == DELMESH_FLOAT32 ? static_cast<double>(*element<float>(values, i)) : *element<double>(values, i);
}
} // namespace

Status SparseTransfer::count(const delmesh_rows& source, int32_t limit) {
    limit_ = limit;
    rounding_ = source.values.type == DELMESH_FLOAT32 ? static_cast<double>(std::numeric_limits<float>::epsilon())
                                                      : std::numeric_limits<double>::epsilon();
    DM_TRY(context_.stage("rows", 0, 0.5));
    DM_TRY(read_offsets(source.offsets, source.values.count));
    DM_TRY(read_entries(source.indices, source.values));
    DM_TRY(sort_rows());
    offsets_.resize_uninitialized(int64_t{mesh_.vertices()} + 1);
    DM_TRY(parallel_slices(context_, mesh_.vertices(), kGrain, 0.5, 1, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t v = begin; v < end; ++v) {
            int64_t size = 0;
            merge(rows_of(static_cast<int32_t>(v)), [&](const Entry&) { ++size; });
            offsets_.data()[v + 1] = std::min<int64_t>(size, limit_);
        }
    }));
    offsets_[0] = 0;
    for (int64_t v = 0; v < mesh_.vertices(); ++v) offsets_[v + 1] += offsets_[v];
    return DELMESH_OK;
}

Status SparseTransfer::read_offsets(const delmesh_view& offsets, int64_t entries) {
    source_offsets_.resize_uninitialized(offsets.count);
    return with_numbers(offsets, [&](auto number) -> Status {
        const auto fail = [&](int64_t v, const char* why, int64_t other) {
            return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE, "Offset %lld of 'source' was %lld, %s %lld.",
                                 static_cast<long long>(v), static_cast<long long>(number(v)), why,
                                 static_cast<long long>(other));
        };
        if (number(0) != 0) return fail(0, "not", 0);
        DM_TRY(in_pieces(context_, offsets.count, 0, 0.1, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t v = begin; v < end; ++v) {
                source_offsets_[v] = number(v);
                if (v > 0 && source_offsets_[v] < source_offsets_[v - 1])
                    return fail(v, "less than the one before it,", source_offsets_[v - 1]);
            }
            return DELMESH_OK;
        }));
        return source_offsets_.back() == entries ? DELMESH_OK : fail(offsets.count - 1, "and the number of values", entries);
    });
}

Status SparseTransfer::read_entries(const delmesh_view& indices, const delmesh_view& values) {
    struct Found {
        int64_t bad, largest; // the first entry that is not taken, or -1; the largest index
    };
    source_.resize_uninitialized(values.count);
    Array<Found> found(context_.memory(), block_count(values.count, kGrain));
    return with_numbers(indices, [&](auto index) -> Status {
        DM_TRY(parallel_slices(context_, values.count, kGrain, 0.1, 0.2, [&](int64_t block, int64_t begin, int64_t end) {
            Found here{-1, -1};
            for (int64_t i = begin; i < end; ++i) {
                const Entry entry{index(i), value_at(values, i)};
                source_.data()[i] = entry;
                here.largest = std::max(here.largest, entry.index);
                if (here.bad < 0 && (entry.index < 0 || !std::isfinite(entry.value))) here.bad = i;
            }
            found.data()[block] = here;
        }));
        for (const Found& block : found) {
            largest_index_ = std::max(largest_index_, block.largest);
            if (block.bad < 0) continue;
            const Entry& entry = source_[block.bad];
            if (entry.index < 0)
                return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE, "Index %lld of 'source' was %lld, less than 0.",
                                     static_cast<long long>(block.bad), static_cast<long long>(entry.index));
            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "Value %lld of 'source' was NaN or infinite.",
                                 static_cast<long long>(block.bad));
        }
        return DELMESH_OK;
    });
}

Status SparseTransfer::sort_rows() {
    const auto before = [](const Entry& a, const Entry& b) { return a.index != b.index ? a.index < b.index : a.value < b.value; };
    return parallel_slices(context_, source_offsets_.size() - 1, kGrain, 0.2, 0.5, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t v = begin; v < end; ++v) {
            Entry *const first = source_.data() + source_offsets_[v], *const last = source_.data() + source_offsets_[v + 1];
            if (!std::is_sorted(first, last, before)) std::sort(first, last, before);
        }
    });
}

SparseTransfer::Rows SparseTransfer::rows_of(int32_t v) const {
    Rows rows;
    const VertexMap map = vertex_map(mesh_, v);
    for (int k = 0; k < 3; ++k) {
        const Entry *const first = source_.data() + source_offsets_[map.vert[k]], *const last = source_.data() +
                                                                                                source_offsets_[map.vert[k] + 1];
        if (map.weight[k] != 0 && first != last) rows.of[rows.count++] = {first, last, map.weight[k]};
    }
    return rows;
}

template <class Use>
void SparseTransfer::merge(Rows rows, Use&& use) {
    while (rows.count > 0) {
        int64_t index = rows.of[0].at->index;
        for (int32_t k = 1; k < rows.count; ++k) index = std::min(index, rows.of[k].at->index);
        double sum = 0;
        for (int32_t k = 0; k < rows.count; ++k) {
            auto& row = rows.of[k];
            for (; row.at != row.end && row.at->index == index; ++row.at) sum += row.weight * row.at->value;
        }
        if (sum != 0) use(Entry{index, sum});
        int32_t left = 0;
        for (int32_t k = 0; k < rows.count; ++k)
            if (rows.of[k].at != rows.of[k].end) rows.of[left++] = rows.of[k];
        rows.count = left;
    }
}

// out has room for all entries of the vertex' source rows.
int64_t SparseTransfer::gather(int32_t v, int32_t normalise, Entry* out) const {
    Entry* end = out;
    merge(rows_of(v), [&](const Entry& entry) { *end++ = entry; });
    const auto sum_of = [](const Entry* from, const Entry* to) {
        double sum = 0;
        for (; from != to; ++from) sum += from->value;
        return sum;
    };
    const double whole = sum_of(out, end);
    if (end - out > limit_) {
        // As integers, the bits of magnitudes are in the same order, and even a NaN (of values that summed past the range) has a
        // place.
        const auto size = [](const Entry& entry) { return std::bit_cast<uint64_t>(std::abs(entry.value)); };
        std::nth_element(out, out + limit_, end, [&](const Entry& a, const Entry& b) {
            return size(a) != size(b) ? size(a) > size(b) : a.index < b.index;
        });
        end = out + limit_;
        std::sort(out, end, [](const Entry& a, const Entry& b) { return a.index < b.index; });
    }
    const double kept = sum_of(out, end), wanted = normalise == 2 ? whole : 1;
    if (normalise == 0 || kept == 0 || std::abs(kept - wanted) <= rounding_ * std::abs(wanted)) return end - out;
    const double factor = wanted / kept; // out of range for the smallest sums
    for (Entry* entry = out; entry != end; ++entry)
        entry->value = std::isinf(factor) ? entry->value / kept * wanted : entry->value * factor;
    return end - out;
}

Status SparseTransfer::write(int32_t normalise, const delmesh_rows_mut& target) {
    const bool entries = target.values.components != 0;
    DM_TRY(context_.stage("write", 0.5, 1));
    if (entries) DM_TRY(make_scratch()); // before anything is written
    DM_TRY(write_offsets(target.offsets));
    if (!entries) return DELMESH_OK;
    return with_index_type(target.indices.type, [&](auto index) {
        using Index = decltype(index);
        return target.values.type == DELMESH_FLOAT32 ? write_rows<Index, float>(normalise, target)
                                                     : write_rows<Index, double>(normalise, target);
    });
}

int64_t SparseTransfer::most_entries(int32_t v) const {
    const Rows rows = rows_of(v);
    int64_t most = 0;
    for (int32_t k = 0; k < rows.count; ++k) most += rows.of[k].end - rows.of[k].at;
    return most;
}

Status SparseTransfer::make_scratch() {
    const int64_t vertices = mesh_.vertices();
    Array<int64_t> needed(context_.memory(), block_count(vertices, kPiece));
    DM_TRY(parallel_slices(context_, vertices, kPiece, 0, 0.1, [&](int64_t block, int64_t begin, int64_t end) {
        int64_t most = 0;
        for (int64_t v = begin; v < end; ++v) most += most_entries(static_cast<int32_t>(v));
        needed.data()[block] = most;
    }));
    scratch_.resize_uninitialized(needed.empty() ? 0 : *std::max_element(needed.begin(), needed.end()));
    places_.resize_uninitialized(std::min(vertices, kPiece));
    return DELMESH_OK;
}

Status SparseTransfer::write_offsets(const delmesh_view_mut& target) {
    return with_index_type(target.type, [&](auto index) {
        using Index = decltype(index);
        return in_pieces(context_, offsets_.size(), 0.1, 0.2, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t v = begin; v < end; ++v) *element<Index>(target, v) = static_cast<Index>(offsets_[v]);
            return DELMESH_OK;
        });
    });
}

template <class Index, class Value>
Status SparseTransfer::write_rows(int32_t normalise, const delmesh_rows_mut& target) {
    const int64_t vertices = mesh_.vertices();
    for (int64_t piece = 0; piece < vertices; piece += kPiece) {
        const int64_t size = std::min(kPiece, vertices - piece);
        int64_t room = 0;
        for (int64_t i = 0; i < size; ++i) {
            places_[i] = room;
            room += most_entries(static_cast<int32_t>(piece + i));
        }
        DM_TRY(context_.progress(0.2 + 0.8 * static_cast<double>(piece) / static_cast<double>(vertices)));
        DM_TRY(context_.parallel(size, kRowsPerBlock, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i) {
                Entry* const row = scratch_.data() + places_[i];
                const int64_t entries = gather(static_cast<int32_t>(piece + i), normalise, row), first = offsets_[piece + i];
                for (int64_t k = 0; k < entries; ++k) {
                    *element<Index>(target.indices, first + k) = static_cast<Index>(row[k].index);
                    *element<Value>(target.values, first + k) = static_cast<Value>(row[k].value);
                }
            }
        }));
    }
    return DELMESH_OK;
}

} // namespace dm
