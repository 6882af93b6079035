#include "transport/counted_bins.h"

#include "transport/bins.h"

namespace beamspread {

std::uint32_t fine_orders(const Medium& medium)
{
    const bool mirrors = medium.ior > 1.0 && medium.thickness <= fine_end;
    return mirrors ? sharp_orders : 0;
}

std::vector<std::size_t> counted_bins(const Medium& medium, std::size_t order_bin, std::size_t radii)
{
    std::vector<std::size_t> bins;
    for (std::size_t k = 0; k < radii; ++k)
        if (order_bin < fine_orders(medium) || ends_quarter(k))
            bins.push_back(k);
    return bins;
}

}  // namespace beamspread
