// What differs between operating systems, compilers and processors. Built and tested: Linux on x86-64 with GCC; the other
// branches are written after their documentation and have not run.
#pragma once

#include <cstddef>
#include <new>
#include <string>

// A function compiled for several instruction sets, the best chosen when the program is loaded (by ELF's indirect
// functions). Without contraction to fused multiply-add the results are the same for all.
#if defined(__ELF__) && defined(__x86_64__)
#define BEAMSPREAD_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define BEAMSPREAD_CLONES
#endif

namespace beamspread {

// Memory that starts at a multiple of `alignment` (a power of two that divides `bytes`), in huge pages where the system
// has them; nullptr if there is none. Only for free_pages().
void* allocate_pages(std::size_t bytes, std::size_t alignment);
void free_pages(void* memory);

long process_id();

// Whether this user may write a file that is there.
bool may_write(const std::string& path);

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
