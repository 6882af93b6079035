// The angular space of Manabe et al. 2012 (Sec. 3.2, Fig. 3), and the brightest point that it is built on.
#pragma once

#include "base/vec.h"
#include "ldf/samples/ldf_sample.h"

namespace beamspread {

struct AngularCoordinates {
    double phi = 0.0;  // [0, 2 pi)
    double psi = 0.0;  // [0, pi/2)
};

// Directions to points P of the plane from the reference point Q, at `height` above the brightest point H. psi is the
// angle at Q between the normal and the direction to P, phi the azimuth of P around H from the beam's direction of
// travel:
//   P = H + height tan(psi) (cos phi, sin phi).
// The paper's text defines phi as the angle at P between the directions to O and H. That angle is 0 everywhere at
// normal incidence, while the paper's Fig. 4 shows phi from 0 to 2 pi; this class therefore takes the azimuth. The
// origin O takes no part in the maps; H - O is the shift of the brightest point. At H, phi is 0.
class AngularSpace {
public:
    // height > 0. Throws InvalidArgument.
    AngularSpace(const Vec2& origin, const Vec2& brightest, double height);

    AngularCoordinates to_angular(const Vec2& point) const;

    // Throws InvalidArgument unless 0 <= psi < pi/2.
    Vec2 to_planar(const AngularCoordinates& at) const;

    const Vec2& origin() const { return m_origin; }
    const Vec2& brightest() const { return m_brightest; }
    double height() const { return m_height; }

private:
    Vec2 m_origin;
    Vec2 m_brightest;
    double m_height;
};

// Brightest point H of Manabe et al. 2012 (Sec. 3.2), in mean free paths from O. An LDF is even in v, hence H lies on
// v = 0 and the image's odd part is noise. The even part is smoothed until the noise is below 1 % of the peak. H is the
// vertex of a paraboloid fitted to the top of the peak: the texels connected with the brightest one that have at least
// 95 % of its value. A peak beside O that the texels do not resolve, as a pencil beam's, is at O.
Vec2 brightest_point(const LdfSample& sample);

}  // namespace beamspread
