// Templates of base/threads.h.
#pragma once

#include <memory>
#include <utility>

namespace beamspread {

namespace detail {
void parallel_ordered(std::size_t count, const std::function<std::shared_ptr<void>(std::size_t)>& make,
                      const std::function<void(std::size_t, std::shared_ptr<void>)>& use);
}

template <class Result>
void parallel_ordered(std::size_t count, const std::function<Result(std::size_t)>& make,
                      const std::function<void(std::size_t, Result)>& use)
{
    detail::parallel_ordered(
        count, [&make](std::size_t i) -> std::shared_ptr<void> { return std::make_shared<Result>(make(i)); },
        [&use](std::size_t i, std::shared_ptr<void> result) {
            use(i, std::move(*static_cast<Result*>(result.get())));
        });
}

}  // namespace beamspread
