// SPDX-License-Identifier: Apache-2.0
#include "api/levels.h"

#include <cmath>

#include "api/views.h"
#include "base/number.h"

namespace dm {

// ---- Targets ----------------------------------------------------------------------------------------------------------------

namespace {

constexpr double kMostCounted = 9007199254740992; // 2^53: doubles count no further

struct Range {
    const char* what; // null: no such kind
    double least, most;
};

Range range_of(int32_t kind) {
    switch (kind) {
    case DELMESH_TARGET_FULL:
        return {"value", -HUGE_VAL, HUGE_VAL}; // not looked at
    case DELMESH_TARGET_VERTICES:
        return {"number of vertices", 0, kMostCounted};
    case DELMESH_TARGET_FACES:
        return {"number of faces", 0, kMostCounted};
    case DELMESH_TARGET_RATIO:
        return {"ratio", 0, 1};
    case DELMESH_TARGET_DEVIATION:
        return {"deviation", 0, HUGE_VAL};
    default:
        return {nullptr, 0, 0};
    }
}

Status check_target(Context& context, const char* name, int32_t i, const delmesh_target& target) {
    const Range range = range_of(target.kind);
    if (range.what == nullptr)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The kind of '%s' %d was %d, which is no DELMESH_TARGET_*.", name, i,
                            target.kind);
    if (target.reserved0 != 0)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The field 'reserved0' of '%s' %d was %d, not 0.", name, i,
                            target.reserved0);
    if (target.kind == DELMESH_TARGET_FULL) return DELMESH_OK;
    if (target.value >= range.least && target.value <= range.most && std::isfinite(target.value)) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The %s of '%s' %d was %s, outside %s to %s.", range.what, name, i,
                        Number(target.value).text, Number(range.least).text, Number(range.most).text);
}

// What is counted, so that less is coarser: 1 vertices, 2 faces, 3 the deviation's opposite.
double amount(const delmesh_target& target, const Mesh& in, int& counted) {
    counted = target.kind == DELMESH_TARGET_VERTICES ? 1 : target.kind == DELMESH_TARGET_DEVIATION ? 3 : 2;
    if (target.kind == DELMESH_TARGET_DEVIATION) return -target.value;
    return std::floor(target.kind == DELMESH_TARGET_RATIO ? target.value * in.faces() : target.value);
}

} // namespace

Status check_targets(Context& context, const Targets& targets, const Mesh& in) {
    if (targets.of == nullptr) return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument '%s' was NULL.", targets.name);
    if (!is_level_count(targets.count))
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'count' was %d, outside 1 to %d.", targets.count,
                            kMostLevels);
    int32_t last[4] = {-1, -1, -1, -1}; // per what is counted, the target before
    for (int32_t i = 0; i < targets.count; ++i) {
        DM_TRY(check_target(context, targets.name, i, targets.of[i]));
        if (targets.of[i].kind == DELMESH_TARGET_FULL) {
            if (i == 0 || targets.of[i - 1].kind == DELMESH_TARGET_FULL) continue;
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                "'%s' %d was DELMESH_TARGET_FULL, which is finer than %d before it.", targets.name, i, i - 1);
        }
        int counted, same;
        const double now = amount(targets.of[i], in, counted);
        if (last[counted] >= 0 && now > amount(targets.of[last[counted]], in, same))
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "'%s' %d, %s, was finer than %d, %s: the finest comes first.",
                                targets.name, i, Number(targets.of[i].value).text, last[counted],
                                Number(targets.of[last[counted]].value).text);
        last[counted] = i;
    }
    return DELMESH_OK;
}

// ---- Values per element -----------------------------------------------------------------------------------------------------

namespace {

constexpr uint32_t kFlagTypes = type_bit(DELMESH_UINT8) | type_bit(DELMESH_INT32);

double number_at(const delmesh_view& view, int64_t i) {
    const auto* at = static_cast<const unsigned char*>(view.data) + i * stride_of(view);
    switch (view.type) {
    case DELMESH_FLOAT32:
        return *reinterpret_cast<const float*>(at);
    case DELMESH_FLOAT64:
        return *reinterpret_cast<const double*>(at);
    case DELMESH_INT32:
        return *reinterpret_cast<const int32_t*>(at);
    default:
        return *at;
    }
}

Status check_values(Context& context, const char* name, const delmesh_view& view, uint32_t types, int64_t count,
                    const char* elements) {
    DM_TRY(check_view(context, name, view, types, 1));
    if (view.count == count) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' had %lld elements, and there were %lld %s.", name,
                        static_cast<long long>(view.count), static_cast<long long>(count), elements);
}

// out[i] = value(number of the source of i)
template <class T, class Value>
Status spread(Context& context, const delmesh_view& view, const Array<int32_t>* sources, int32_t count, Array<T>& out,
              Value&& value) {
    out.resize_uninitialized(count);
    const int32_t* source = sources == nullptr || sources->empty() ? nullptr : sources->data();
    return context.parallel(count, 1 << 16, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) out.data()[i] = value(number_at(view, source == nullptr ? i : source[i]));
    });
}

} // namespace

Status SourceValues::read(Context& context, const Mesh& in, const delmesh_decimate_options& options) {
    // The source of a mesh that was imported are the caller's arrays: without the copies that import made, with polygons whole.
    const Array<int32_t>* verts_from = in.imported ? &in.vert_source : nullptr;
    const Array<int32_t>* faces_from = in.imported ? &in.face_source : nullptr;
    const int64_t verts = in.vertices() - (in.imported ? in.counts.copied_vertices : 0);
    const int64_t faces = in.imported ? in.counts.polygons : in.faces();
    const delmesh_view &weights = options.vert_weights, &locked = options.locked_verts, &mask = options.face_mask;
    const auto is_set = [](double x) { return static_cast<uint8_t>(x != 0); };
    if (is_given(weights)) DM_TRY(check_values(context, "vert_weights", weights, kFloatTypes, verts, "source vertices"));
    if (is_given(locked)) DM_TRY(check_values(context, "locked_verts", locked, kFlagTypes, verts, "source vertices"));
    if (is_given(mask)) DM_TRY(check_values(context, "face_mask", mask, kFlagTypes, faces, "source polygons"));
    for (int64_t v = 0; is_given(weights) && v < verts; ++v) {
        const double weight = number_at(weights, v);
        if (!(weight > 0) || !std::isfinite(weight))
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The weight %lld of 'vert_weights' was %s, not a number over 0.",
                                static_cast<long long>(v), Number(weight).text);
    }
    if (is_given(weights)) DM_TRY(spread(context, weights, verts_from, in.vertices(), weights_, [](double x) { return x; }));
    if (is_given(locked)) DM_TRY(spread(context, locked, verts_from, in.vertices(), locked_, is_set));
    if (is_given(mask)) DM_TRY(spread(context, mask, faces_from, in.faces(), mask_, is_set));
    return DELMESH_OK;
}

DecimationInput SourceValues::input() const {
    DecimationInput input;
    if (!weights_.empty()) input.vert_weights = weights_.data();
    if (!locked_.empty()) input.locked_verts = locked_.data();
    if (!mask_.empty()) input.face_mask = mask_.data();
    return input;
}

// ---- Reports ----------------------------------------------------------------------------------------------------------------

LevelReports::LevelReports(const char* name, delmesh_level_report* out, int32_t count) : name_(name) {
    for (delmesh_level_report& value : values) value = defaults<delmesh_level_report>();
    if (out == nullptr || !is_level_count(count)) return;
    out_ = reinterpret_cast<unsigned char*>(out);
    count_ = count;
    size_ = out->struct_size;
}

int32_t LevelReports::wrong_size() const {
    if (!is_struct_size(size_)) return 0;
    for (int32_t i = 1; i < count_; ++i) {
        uint32_t size;
        std::memcpy(&size, report(i), sizeof size);
        if (size != size_) return i;
    }
    return count_;
}

Status LevelReports::check(Context& context) const {
    if (out_ == nullptr) return DELMESH_OK;
    const int32_t i = wrong_size();
    if (i == count_) return DELMESH_OK;
    uint32_t size;
    std::memcpy(&size, i == 0 ? out_ : report(i), sizeof size);
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The struct_size of '%s' %d was %u: all of them take their _init.", name_,
                        i, size);
}

LevelReports::~LevelReports() {
    if (out_ == nullptr || wrong_size() != count_) return;
    for (int32_t i = 0; i < count_; ++i) {
        values[i].struct_size = size_;
        std::memcpy(report(i), &values[i], size_ < sizeof values[i] ? size_ : sizeof values[i]);
    }
}

} // namespace dm
