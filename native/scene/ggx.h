// A GGX lobe (Walter et al. 2007) with Smith's height-correlated masking (Heitz 2014, "Understanding the masking-shadowing
// function", JCGT 3(2)) and Schlick's Fresnel term, in the frame of the surface: z is the normal.
#pragma once

#include "base/vec.h"

namespace beamspread {

// Smallest alpha of a lobe, roughness .32. Narrower lobes are widened to it: shadow rays toward small lamps rarely run
// within them, so that their light would be noise. Larger values blur reflections more.
inline constexpr double min_alpha = 0.1;

class GgxLobe {
public:
    // `view` is a unit vector with z > 0; `alpha` at least `min_alpha`.
    GgxLobe(const Vec3& view, double alpha);

    // pi times the lobe without its Fresnel term, for a unit vector with z > 0.
    double value(const Vec3& direction) const;

    // Density of the directions that `sample` draws, 1/sr.
    double density(const Vec3& direction) const;

    // Draws a direction from visible normals, which may lie below the surface (Dupuy and Benyoub 2023, "Sampling visible
    // GGX normals with spherical caps", doi:10.1111/cgf.14867).
    Vec3 sample(const Vec2& place) const;

    // Cosine between the view and the half vector.
    double half_cosine(const Vec3& direction) const;

private:
    double distribution(double cosine) const;
    double lambda(double cosine) const;

    Vec3 m_view;
    double m_alpha;
    double m_lambda;  // of the view
};

// Schlick's Fresnel term is f0 + (1 - f0) times this.
double schlick_weight(double cosine);

// Reflectance of a lobe under even light: `even` without a Fresnel term, `edge` with Schlick's weight as the Fresnel
// term, so that a lobe reflects f0 (even - edge) + edge.
struct LobeAlbedo {
    double even;
    double edge;
};

// From a table over the cosine of the view and the roughness, right within 2e-3.
LobeAlbedo lobe_albedo(double cosine, double alpha);

}  // namespace beamspread
