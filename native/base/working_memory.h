// Working memory of loops.
#pragma once

#include <vector>

#include <oneapi/tbb/cache_aligned_allocator.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

namespace beamspread {

// Begins with a line of the cache: vectors that are loaded from it don't straddle two.
template <class T>
using AlignedVector = std::vector<T, oneapi::tbb::cache_aligned_allocator<T>>;

// An object for each thread that asks by `local()`, which comes with what it held. No parallel loop may begin while it is
// in use, as its thread may help other loops.
template <class T>
using PerThread = oneapi::tbb::enumerable_thread_specific<T>;

}  // namespace beamspread
