// SPDX-License-Identifier: Apache-2.0
// OpenSubdiv's part of a Limit, for the files that speak to it.
#pragma once

#include <memory>
#include <mutex>
#include <shared_mutex>

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/bfr/surfaceFactoryCache.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefiner.h>

#include "subdiv/cage.h"

namespace dm {

namespace Osd = OpenSubdiv::OPENSUBDIV_VERSION;

struct Limit::Made {
    explicit Made(std::unique_ptr<Osd::Far::TopologyRefiner> made);

    using Cache = Osd::Bfr::SurfaceFactoryCacheThreaded<std::shared_mutex, std::shared_lock<std::shared_mutex>,
                                                        std::unique_lock<std::shared_mutex>>;
    std::unique_ptr<Osd::Far::TopologyRefiner> refiner;
    Osd::Bfr::RefinerSurfaceFactory<Cache> surfaces;
};

} // namespace dm
