// Memory for big tables that are filled once or a few times.
#pragma once

#include <cstddef>
#include <new>

#include "base/platform.h"

namespace beamspread {

// For containers, in whole huge pages: the first touch of memory in pages of 4 KB took a fifth of a short simulation.
template <class T>
struct HugePageAllocator {
    using value_type = T;

    HugePageAllocator() = default;
    template <class U>
    explicit HugePageAllocator(const HugePageAllocator<U>& /*other*/)
    {
    }

    T* allocate(std::size_t count)
    {
        constexpr std::size_t huge_page = std::size_t{1} << 21;
        const std::size_t bytes = (count * sizeof(T) + huge_page - 1) / huge_page * huge_page;
        void* memory = allocate_pages(bytes, huge_page);
        if (memory == nullptr)
            throw std::bad_alloc();
        return static_cast<T*>(memory);
    }

    void deallocate(T* memory, std::size_t /*count*/) { free_pages(memory); }

    friend bool operator==(const HugePageAllocator&, const HugePageAllocator&) = default;
};

}  // namespace beamspread
