// The angular space of Manabe et al. 2012 (Sec. 3.2, Fig. 3), and the brightest point that it is built on.
#pragma once

#include "base/vec.h"
#include "ldf/samples/ldf_sample.h"

namespace beamspread {

struct AngularCoordinates {
    double phi = 0.0;  // [0, 2 pi)
    double psi = 0.0;  // [0, pi/2)
};

// Places P of the plane as seen from the reference point Q at `height` above the brightest point H: psi is the angle at
// Q between the normal and the direction to P, phi the azimuth of P around H from the beam's direction of travel,
//   P = H + height tan(psi) (cos phi, sin phi).
// The paper's text takes for phi the angle at P between the directions to O and H, but that is 0 everywhere at normal
// incidence, and its Fig. 4 shows phi from 0 to 2 pi. O, the origin, therefore takes no part in the maps; O - H is the
// brightest point's shift. At H itself phi is 0.
class AngularSpace {
public:
    // height > 0. Throws InvalidArgument.
    AngularSpace(const Vec2& origin, const Vec2& brightest, double height);

    AngularCoordinates to_angular(const Vec2& place) const;

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

// H of Manabe et al. 2012 (Sec. 3.2), mean free paths from O. An LDF is even in v, so H lies on v = 0, and what is odd
// in v is noise: the image's even part is smoothed as little as brings that noise below 1 % of the peak. H then is the
// vertex of the paraboloid fitted to the top of the peak, all texels around the brightest one of at least 95 % of it.
// Where the top is so narrow that the texels don't resolve it, and is next to O, H is O: a pencil beam's peak.
Vec2 brightest_point(const LdfSample& sample);

}  // namespace beamspread
