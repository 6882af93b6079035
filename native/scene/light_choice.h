// One shadow ray from a point toward one of many lights.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/random.h"
#include "scene/bounce_guide.h"
#include "scene/bsdf.h"
#include "scene/light.h"
#include "scene/occluders.h"

namespace beamspread {

// A light of the scene, its color and strength, and the triangles that block it; null: none do.
struct SceneLight {
    const Light* light = nullptr;
    Vec3f color{1.0f};
    const Occluders* occluders = nullptr;
};

// A point of a surface that reflects light.
struct ShadingPoint {
    Vec3 position;
    Vec3 normal;
    double rounding = 0.0;  // metres; shadow rays start so far above the surface
    Bsdf bsdf;
};

// A ray that brings radiance to the viewer unless it is blocked.
struct LitRay {
    ShadowRay shadow_ray;
    Vec3f radiance{0.0f};  // W/(m^2 sr); 0: no ray
    const Occluders* occluders = nullptr;
    GuideRecord record{};
};

// Resampled importance sampling (Talbot, Cline, Egbert 2005, "Importance resampling for global illumination"): several
// candidates are drawn, of each light if there are few, and one is chosen by the light that it brings if nothing blocks it.
// The estimate has no bias: the mean over many rays, times their transmittance, is the reflected radiance.
class LightChoice {
public:
    // The lights must outlive the object.
    explicit LightChoice(std::span<const SceneLight> lights);

    // Chooses among many lights by the light that they bring to such points on the mean.
    void learn(std::span<const ShadingPoint> points, Random& random);

    // Chooses lights and directions of the sky by their visibility. The guide must outlive the object; null: none.
    void set_guide(const BounceGuide* guide) { m_guide = guide; }

    LitRay choose(const ShadingPoint& point, Random& random) const;

    std::size_t count() const { return m_lights.size(); }
    bool is_empty() const { return m_lights.empty(); }

private:
    struct Candidate {
        LightRay ray{};
        Vec3f radiance{0.0f};  // that it brings to the viewer
        float glow = 0.0f;     // flux of the ray, mean of the channels
        std::size_t light = 0;
    };
    class Reservoir;

    // A ray of a light.
    Candidate candidate(std::size_t light, const ShadingPoint& point, Random& random) const;
    // Rays of a distant light, some of which the guide has chosen.
    void offer_guided(std::size_t light, const ShadingPoint& point, std::uint32_t cell, Reservoir& reservoir,
                      Random& random) const;
    void offer_few(const ShadingPoint& point, std::uint32_t cell, Reservoir& reservoir, Random& random) const;
    void offer_many(const ShadingPoint& point, std::uint32_t cell, Reservoir& reservoir, Random& random) const;
    Candidate with_radiance(std::size_t light, const ShadingPoint& point, const LightRay& ray) const;
    float visibility(std::uint32_t cell, std::size_t light) const;

    std::vector<SceneLight> m_lights;
    std::vector<std::shared_ptr<const Light>> m_prepared;
    std::vector<const DistantLight*> m_distant;  // [light] null for others
    std::vector<double> m_cumulated;  // probabilities of many lights; one more than lights
    const BounceGuide* m_guide = nullptr;
};

}  // namespace beamspread
