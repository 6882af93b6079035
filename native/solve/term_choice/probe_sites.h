// Sites of a plane at which the radiance is probed.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/incidence.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Largest offset of a site's texels from its middle (17 x 17 texels), and number of texels that are probed in it; their
// mean stands for the mean of all.
inline constexpr std::size_t site_reach = 8;
inline constexpr std::size_t texels_per_site = 9;

// Texels of the probe sites, site after site, from a fixed seed: over the whole plane, at light edges and on their dark
// side, and around the texels where each light is brightest, steepest, most grazing, and nearest to its lamp.
std::vector<Texel> probe_sites(const LightTerms& light, const std::vector<std::size_t>& lights,
                               const Incidence& incidence);

// Texels of sites near some texels; other texels for every `draw`.
std::vector<Texel> sites_around(const std::vector<Texel>& texels, const Plane& plane, std::size_t draw);

}  // namespace beamspread
