#include "base/threads.h"

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include "base/error.h"

namespace beamspread {

namespace {
int thread_count(int threads)
{
    if (threads < 0)
        reject("threads", threads, "0 (all) or more");
    return threads == 0 ? tbb::info::default_concurrency() : threads;
}
}  // namespace

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body)
{
    tbb::task_arena arena(thread_count(threads));
    arena.execute([&] { tbb::parallel_for(std::size_t{0}, count, body, tbb::simple_partitioner{}); });
}

void detail::parallel_ordered(std::size_t count, int threads,
                              const std::function<std::shared_ptr<void>(std::size_t)>& make,
                              const std::function<void(std::size_t, std::shared_ptr<void>)>& use)
{
    using Item = std::pair<std::size_t, std::shared_ptr<void>>;
    const int concurrency = thread_count(threads);
    tbb::task_arena arena(concurrency);
    std::size_t next = 0;
    arena.execute([&] {
        // Twice as many results in flight as threads: enough to hide uneven work items.
        tbb::parallel_pipeline(
            static_cast<std::size_t>(2 * concurrency),
            tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) {
                if (next == count)
                    flow.stop();
                return next == count ? next : next++;
            }) & tbb::make_filter<std::size_t, Item>(tbb::filter_mode::parallel, [&](std::size_t i) {
                return Item(i, make(i));
            }) & tbb::make_filter<Item, void>(tbb::filter_mode::serial_in_order, [&](Item item) {
                use(item.first, std::move(item.second));
            }));
    });
}

}  // namespace beamspread
