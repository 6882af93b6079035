// The places of a plane whose radiance is looked at.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/incidence.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// A site is 17 x 17 texels, of which some are looked at: the mean of these stands for the mean of all.
inline constexpr std::size_t site_reach = 8;
inline constexpr std::size_t texels_per_site = 9;

// Their texels, site after site; drawn by chance but always the same: all over the plane, where it is lit, where the
// light changes and in the dark beside, and around the places where each light is extreme or comes from.
std::vector<Texel> probe_sites(const LightTerms& light, const std::vector<std::size_t>& lights,
                               const Incidence& incidence);

// Of sites close to some texels; other ones for every `draw`.
std::vector<Texel> sites_around(const std::vector<Texel>& texels, const Plane& plane, std::size_t draw);

}  // namespace beamspread
