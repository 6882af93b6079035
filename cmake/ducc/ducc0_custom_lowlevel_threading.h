// What DUCC is to know of threads: real locks around its cache of plans, which our threads share, and no
// threads of its own (base/threads.h has them all).
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>

namespace DUCC0_NAMESPACE {
namespace detail_threading {

using Mutex = std::mutex;
using UniqueLock = std::unique_lock<std::mutex>;
using LockGuard = std::lock_guard<std::mutex>;
using CondVar = std::condition_variable;

class SequentialPool final : public thread_pool {
public:
    std::size_t nthreads() const override { return 1; }
    std::size_t adjust_nthreads(std::size_t) const override { return 1; }
    void submit(std::function<void()> work) override { work(); }
};

inline thread_local bool in_parallel_region = false;

inline std::size_t available_hardware_threads()
{
    return 1;
}

inline std::size_t ducc0_default_num_threads()
{
    return 1;
}

inline thread_pool* get_active_pool()
{
    static SequentialPool pool;
    return &pool;
}

inline thread_pool* set_active_pool(thread_pool*)
{
    return get_active_pool();
}

}  // namespace detail_threading
}  // namespace DUCC0_NAMESPACE
