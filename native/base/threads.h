// Threads: oneTBB behind one header.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <oneapi/tbb/cache_aligned_allocator.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

namespace beamspread {

// Calls body() on this thread; parallel loops inside it use up to `threads` threads (0: all), this one among
// them. Once around a whole job: setting the threads up costs more than a short loop.
void with_threads(int threads, const std::function<void()>& body);

// How many threads a parallel loop started here may use.
std::size_t thread_count();

// Calls body(0) .. body(count - 1). An exception in a body stops the loop and is rethrown here.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

// Calls make(i) in parallel, and what it returns one at a time in the order of i, so that sums come out the same, bit
// for bit, for any number of threads. At most a few results exist at once.
void parallel_ordered(std::size_t count, const std::function<std::function<void()>(std::size_t)>& make);

// Begins with a line of the cache: vectors that are loaded from it don't straddle two.
template <class T>
using AlignedVector = std::vector<T, oneapi::tbb::cache_aligned_allocator<T>>;

// An object for each thread that asks by `local()`, which comes with what it held. No parallel loop may begin while it is
// in use, as its thread may help other loops.
template <class T>
using PerThread = oneapi::tbb::enumerable_thread_specific<T>;

}  // namespace beamspread
