// Threads: oneTBB behind one header.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <oneapi/tbb/cache_aligned_allocator.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

namespace beamspread {

// Calls body() on this thread. Parallel loops inside it use up to `threads` threads (0: all), this one included. Use it
// once around a whole job: setting up the threads costs more than a short loop. Inside a call for as many threads it
// costs next to nothing.
void with_threads(int threads, const std::function<void()>& body);

// Number of threads that a parallel loop started here may use.
std::size_t thread_count();

// Calls body(0) .. body(count - 1). An exception in a body stops the loop and is rethrown here.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

// Calls make(i) in parallel and the returned functions one at a time, in the order of i: sums are the same, bit for
// bit, for any number of threads. Only a few results exist at once.
void parallel_ordered(std::size_t count, const std::function<std::function<void()>(std::size_t)>& make);

// Array that starts at a cache line, so that no SIMD load straddles two lines.
template <class T>
using AlignedVector = std::vector<T, oneapi::tbb::cache_aligned_allocator<T>>;

// One object per thread; `local()` returns this thread's, with the values that it left there. Do not start a parallel
// loop while using it: the thread may help other loops, which use the same object.
template <class T>
using PerThread = oneapi::tbb::enumerable_thread_specific<T>;

}  // namespace beamspread
