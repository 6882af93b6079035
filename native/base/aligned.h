// Working memory of inner loops.
#pragma once

#include <vector>

#include <oneapi/tbb/cache_aligned_allocator.h>

namespace beamspread {

// Begins with a line of the cache: vectors that are loaded from it don't straddle two.
template <class T>
using AlignedVector = std::vector<T, oneapi::tbb::cache_aligned_allocator<T>>;

}  // namespace beamspread
