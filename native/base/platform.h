// Differences between operating systems. Linux on x86-64 with GCC is built and tested; the
// other branches follow their documentation and have not run.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <new>
#include <string>

namespace beamspread {

// Allocates memory that starts at a multiple of `alignment` (a power of two that divides `bytes`), in huge pages where
// the system has them. Returns nullptr on failure. Release it with free_pages().
void* allocate_pages(std::size_t bytes, std::size_t alignment);
void free_pages(void* memory);

long process_id();

// True if this user may write the existing file.
bool may_write(const std::string& path);

// Moves the position of an open file, in bytes from its start. False, with errno set, if that fails.
bool seek_file(std::FILE* file, std::uint64_t position);

// Writes every buffered byte to the disk. False, with errno set, if that fails.
bool flush_to_disk(std::FILE* file);

// Allocator for containers, in whole huge pages: the first touch of pages of 4 KB took a fifth of a short simulation.
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

// Memory in whole huge pages that is not cleared.
template <class T>
class HugePages {
public:
    HugePages() = default;
    explicit HugePages(std::size_t count) : m_memory(HugePageAllocator<T>().allocate(std::max<std::size_t>(count, 1)))
    {
    }

    T* data() const { return m_memory.get(); }

private:
    struct Free {
        void operator()(T* memory) const { free_pages(memory); }
    };

    std::unique_ptr<T, Free> m_memory;
};

}  // namespace beamspread
