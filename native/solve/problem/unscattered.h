// Light that leaves a slab without scattering; added after every solver.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// Adds the light that a slab with an ior above 1 returns unscattered from its far boundary to (height, width,
// channels).
void add_unscattered(const Problem& problem, float* luminance);

// Sums the unscattered light of rays, from any number of threads at once, in integers: their sum does not depend on the
// order.
class UnscatteredRays {
public:
    explicit UnscatteredRays(const Problem& problem);
    ~UnscatteredRays();
    UnscatteredRays(const UnscatteredRays&) = delete;
    UnscatteredRays& operator=(const UnscatteredRays&) = delete;

    // True if nothing returns unscattered.
    bool is_empty() const { return m_sums.empty(); }

    void add(const RayRow& rays, const std::vector<double>& color);
    void add_to(float* luminance) const;
    void clear();

private:
    struct Exits;

    Plane m_plane;
    const float* m_entering;  // as of `Problem`
    std::unique_ptr<Exits> m_exits;
    double m_unit;                     // of the sums, W/(m^2 sr)
    std::vector<std::int64_t> m_sums;  // [texel][channel]
};

}  // namespace beamspread
