#include "base/threads.h"

#include <algorithm>

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include "base/error.h"

namespace beamspread {

void with_threads(int threads, const std::function<void()>& body)
{
    if (threads < 0)
        reject("threads", threads, "0 (all) or more");
    // More threads than cores gain nothing and make TBB write a warning to the host's stderr.
    const int cores = tbb::info::default_concurrency();
    const int wanted = threads == 0 ? cores : std::min(threads, cores);
    const bool are_set_up = tbb::this_task_arena::current_thread_index() != tbb::task_arena::not_initialized;
    if (are_set_up && tbb::this_task_arena::max_concurrency() == wanted) {
        tbb::this_task_arena::isolate(body);  // this thread helps no loops around it, which use the same objects
        return;
    }
    tbb::task_arena arena(wanted);
    arena.execute(body);
}

std::size_t thread_count()
{
    return static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
}

void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body)
{
    tbb::parallel_for(std::size_t{0}, count, body, tbb::simple_partitioner{});
}

void parallel_ordered(std::size_t count, const std::function<std::function<void()>(std::size_t)>& make)
{
    using Use = std::function<void()>;
    // Two results in flight per thread hide uneven work items.
    const auto in_flight = 2 * thread_count();
    std::size_t next = 0;
    const auto take =
        tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) {
            if (next == count)
                flow.stop();
            return next == count ? next : next++;
        });
    const auto work = tbb::make_filter<std::size_t, Use>(tbb::filter_mode::parallel, make);
    const auto merge = tbb::make_filter<Use, void>(tbb::filter_mode::serial_in_order, [](const Use& use) { use(); });
    tbb::parallel_pipeline(in_flight, take & work & merge);
}

}  // namespace beamspread
