// SPDX-License-Identifier: Apache-2.0
// What a call that decimates is given beside its options: targets, values per element of the source, reports per level.
#pragma once

#include "algo/decimate.h"
#include "api/options.h"

namespace dm {

constexpr int32_t kMostLevels = 64;
inline bool is_level_count(int32_t count) {
    return count >= 1 && count <= kMostLevels;
}

struct Targets {
    const char* name; // of the argument
    const delmesh_target* of;
    int32_t count;
};
// Every target on its own, and none finer than those before it that count the same.
Status check_targets(Context& context, const Targets& targets, const Mesh& in);

// The caller's views of values per source vertex and source polygon, as arrays per vertex and face of the Mesh.
class SourceValues {
public:
    explicit SourceValues(Memory& memory) : weights_(memory), locked_(memory), mask_(memory) {}
    // options have been read but their views not checked.
    Status read(Context& context, const Mesh& in, const delmesh_decimate_options& options);
    DecimationInput input() const;

private:
    Array<double> weights_;
    Array<uint8_t> locked_, mask_;
};

// The caller's reports, one after the other, of whatever size he has. Written when the scope is left, after errors too.
class LevelReports {
public:
    LevelReports(const char* name, delmesh_level_report* out, int32_t count);
    ~LevelReports();
    LevelReports(const LevelReports&) = delete;
    LevelReports& operator=(const LevelReports&) = delete;

    Status check(Context& context) const;

    delmesh_level_report values[kMostLevels];

private:
    unsigned char* report(int32_t i) const { return out_ + static_cast<int64_t>(i) * size_; }
    int32_t wrong_size() const; // the first report that has not the size of the first; count_ if all have

    const char* name_;
    unsigned char* out_ = nullptr; // nullptr: not asked for
    int32_t count_ = 0;
    uint32_t size_ = 0; // of each, as the caller knows it: also the way from one to the next
};

} // namespace dm
