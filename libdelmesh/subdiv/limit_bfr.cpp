// SPDX-License-Identifier: Apache-2.0
#include "subdiv/limit_osd.h"

#include <opensubdiv/bfr/tessellation.h>

namespace dm {
namespace {

// OpenSubdiv's defaults are 2 and 6; at 2, points beside irregular vertices are off by up to 3e-3 of the size of a cage
// (docs/subdivide.md).
constexpr int kSmoothLevel = 6, kSharpLevel = 8;
// OpenSubdiv keeps what it has refined around an irregular face, for faces around which all is alike. Beside a vertex of n faces
// that takes n^2 numbers, and where it is on a boundary no two of its faces are alike: n = 400 took 6 GB. So it keeps nothing
// of cages with such a vertex (or face, which it counts, too).
constexpr int kMostKept = 64;

Osd::Sdc::SchemeType scheme_of(const CageRules& rules) {
    switch (rules.scheme) {
    case DELMESH_SCHEME_LOOP:
        return Osd::Sdc::SCHEME_LOOP;
    case DELMESH_SCHEME_BILINEAR:
        return Osd::Sdc::SCHEME_BILINEAR;
    default:
        return Osd::Sdc::SCHEME_CATMARK;
    }
}

Osd::Sdc::Options options_of(const CageRules& rules) {
    using Options = Osd::Sdc::Options;
    Options options;
    switch (rules.boundary) {
    case DELMESH_CAGE_BOUNDARY_NONE:
        options.SetVtxBoundaryInterpolation(Options::VTX_BOUNDARY_NONE);
        break;
    case DELMESH_CAGE_BOUNDARY_EDGE:
        options.SetVtxBoundaryInterpolation(Options::VTX_BOUNDARY_EDGE_ONLY);
        break;
    default:
        options.SetVtxBoundaryInterpolation(Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    }
    switch (rules.face_varying) {
    case DELMESH_FACE_VARYING_NONE:
        options.SetFVarLinearInterpolation(Options::FVAR_LINEAR_NONE);
        break;
    case DELMESH_FACE_VARYING_CORNERS_ONLY:
        options.SetFVarLinearInterpolation(Options::FVAR_LINEAR_CORNERS_ONLY);
        break;
    case DELMESH_FACE_VARYING_CORNERS_PLUS1:
        options.SetFVarLinearInterpolation(Options::FVAR_LINEAR_CORNERS_PLUS1);
        break;
    case DELMESH_FACE_VARYING_CORNERS_PLUS2:
        options.SetFVarLinearInterpolation(Options::FVAR_LINEAR_CORNERS_PLUS2);
        break;
    case DELMESH_FACE_VARYING_ALL:
        options.SetFVarLinearInterpolation(Options::FVAR_LINEAR_ALL);
        break;
    default:
        options.SetFVarLinearInterpolation(Options::FVAR_LINEAR_BOUNDARIES);
    }
    options.SetCreasingMethod(rules.creasing == DELMESH_CREASING_CHAIKIN ? Options::CREASE_CHAIKIN : Options::CREASE_UNIFORM);
    options.SetTriangleSubdivision(rules.smooth_triangles != 0 ? Options::TRI_SUB_SMOOTH : Options::TRI_SUB_CATMARK);
    return options;
}

// What OpenSubdiv would refuse, or print about, the cage has been checked for.
std::unique_ptr<Osd::Far::TopologyRefiner> make_refiner(Memory& memory, const Cage& cage) {
    using Descriptor = Osd::Far::TopologyDescriptor;
    Array<int32_t> sizes(memory), holes(memory);
    for (int32_t f = 0; f < cage.faces(); ++f) {
        sizes.push_back(cage.face_size(f));
        if (cage.hole[f] != 0) holes.push_back(f);
    }
    Array<Descriptor::FVarChannel> channels(memory);
    for (const CageLayer& layer : cage.layers) {
        if (layer.channel < 0) continue;
        Descriptor::FVarChannel channel;
        channel.numValues = static_cast<int>(layer.value_count);
        channel.valueIndices = cage.index_of(layer);
        channels.push_back(channel);
    }
    Descriptor d;
    d.numVertices = cage.vertices();
    d.numFaces = cage.faces();
    d.numVertsPerFace = sizes.data();
    d.vertIndicesPerFace = cage.corner_vert.data();
    d.numCreases = static_cast<int>(cage.crease_sharpness.size());
    d.creaseVertexIndexPairs = cage.crease_verts.data();
    d.creaseWeights = cage.crease_sharpness.data();
    d.numCorners = static_cast<int>(cage.vert_sharpness.size());
    d.cornerVertexIndices = cage.sharp_verts.data();
    d.cornerWeights = cage.vert_sharpness.data();
    d.numHoles = static_cast<int>(holes.size());
    d.holeIndices = holes.data();
    d.numFVarChannels = static_cast<int>(channels.size());
    d.fvarChannels = channels.data();
    using Factory = Osd::Far::TopologyRefinerFactory<Descriptor>;
    return std::unique_ptr<Osd::Far::TopologyRefiner>(
        Factory::Create(d, Factory::Options(scheme_of(cage.rules), options_of(cage.rules))));
}

} // namespace

// ---- Limit ------------------------------------------------------------------------------------------------------------------

Limit::Made::Made(std::unique_ptr<Osd::Far::TopologyRefiner> made)
    : refiner(std::move(made)), surfaces(*refiner, Osd::Bfr::SurfaceFactory::Options()
                                                       .SetApproxLevelSmooth(kSmoothLevel)
                                                       .SetApproxLevelSharp(kSharpLevel)
                                                       .EnableCaching(refiner->GetMaxValence() <= kMostKept)) {}

Limit::~Limit() {
    delete made_;
}

Status Limit::build(Context& context, const Cage& cage) {
    auto refiner = make_refiner(context.memory(), cage);
    if (refiner == nullptr) return context.fail(DELMESH_ERROR_INTERNAL, "OpenSubdiv did not take the cage's faces.");
    made_ = new Made(std::move(refiner));
    return DELMESH_OK;
}

bool Limit::has_face(int32_t f) const {
    return made_->surfaces.FaceHasLimitSurface(f);
}

Limit::Counts Limit::count(int32_t face_size, int32_t rate) const {
    const Osd::Bfr::Tessellation triangles(Osd::Bfr::Parameterization(made_->surfaces.GetSchemeType(), face_size), rate);
    return {triangles.GetNumCoords(), triangles.GetNumFacets()};
}

void Limit::cut(int32_t face_size, int32_t rate, FacePattern& pattern) const {
    const Osd::Bfr::Parameterization parameters(made_->surfaces.GetSchemeType(), face_size);
    const bool quads = parameters.GetType() != Osd::Bfr::Parameterization::TRI;
    const Osd::Bfr::Tessellation tessellation(parameters, rate,
                                              Osd::Bfr::Tessellation::Options().SetFacetSize(4).PreserveQuads(quads));
    Array<double> coordinates(pattern.places.memory());
    coordinates.resize_uninitialized(2 * int64_t{tessellation.GetNumCoords()});
    tessellation.GetCoords(coordinates.data());
    pattern.places.resize_uninitialized(coordinates.size());
    for (int64_t i = 0; i < coordinates.size(); i += 2) {
        double place[2] = {coordinates[i], coordinates[i + 1]};
        if (parameters.HasSubFaces()) {
            double uv[2];
            const int sub_face = parameters.ConvertCoordToNormalizedSubFace(&coordinates[i], uv);
            place_of(face_size, {sub_face, uv[0], uv[1]}, place[0], place[1]);
        }
        pattern.places[i] = static_cast<float>(place[0]);
        pattern.places[i + 1] = static_cast<float>(place[1]);
    }
    pattern.facets.resize_uninitialized(4 * int64_t{tessellation.GetNumFacets()});
    tessellation.GetFacets(pattern.facets.data());
}

// ---- Evaluation -------------------------------------------------------------------------------------------------------------

struct LimitEvaluator::Made {
    const Limit::Made& limit;
    Osd::Bfr::Surface<double> surface;
    Osd::Bfr::Surface<double>::PointDescriptor points_of;
    Osd::Bfr::Parameterization parameters;
    std::unique_ptr<double[]> points;
    int64_t room = 0;

    explicit Made(const Limit& of) : limit(of.made()) {}
    void place(float s, float t, double uv[2]) const {
        uv[0] = static_cast<double>(s);
        uv[1] = static_cast<double>(t);
        if (!parameters.HasSubFaces()) return;
        const SubFacePlace sub = sub_face_of(parameters.GetFaceSize(), uv[0], uv[1]);
        const double inside[2] = {sub.u, sub.v};
        parameters.ConvertNormalizedSubFaceToCoord(sub.corner, inside, uv);
    }
};

LimitEvaluator::LimitEvaluator(const Limit& limit) : made_(new Made(limit)) {}
LimitEvaluator::~LimitEvaluator() {
    delete made_;
}

void LimitEvaluator::face(int32_t f, int32_t channel) {
    if (channel < 0)
        made_->limit.surfaces.InitVertexSurface(f, &made_->surface);
    else
        made_->limit.surfaces.InitFaceVaryingSurface(f, &made_->surface, channel);
    made_->parameters = made_->surface.GetParameterization();
}

void LimitEvaluator::take(const double* values, int32_t components) {
    const int64_t needed = int64_t{made_->surface.GetNumPatchPoints()} * components;
    if (needed > made_->room) {
        made_->points.reset(new double[static_cast<size_t>(needed)]);
        made_->room = needed;
    }
    made_->points_of = {components, components};
    made_->surface.PreparePatchPoints(values, made_->points_of, made_->points.get(), made_->points_of);
}

void LimitEvaluator::at(float s, float t, double* value) {
    double uv[2];
    made_->place(s, t, uv);
    made_->surface.Evaluate(uv, made_->points.get(), made_->points_of, value);
}

void LimitEvaluator::at(float s, float t, double* value, double* ds, double* dt) {
    double uv[2];
    made_->place(s, t, uv);
    made_->surface.Evaluate(uv, made_->points.get(), made_->points_of, value, ds, dt);
}

} // namespace dm
