#include "base/platform.h"

#include <cerrno>
#include <cstdlib>

#ifdef _WIN32
#include <io.h>
#include <malloc.h>
#include <process.h>
#else
#include <unistd.h>
#endif
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace beamspread {

#ifdef _WIN32

void* allocate_pages(std::size_t bytes, std::size_t alignment)
{
    return _aligned_malloc(bytes, alignment);
}

void free_pages(void* memory)
{
    _aligned_free(memory);
}

long process_id()
{
    return _getpid();
}

bool may_write(const std::string& path)
{
    constexpr int write = 2;
    return _access(path.c_str(), write) == 0;
}

bool seek_file(std::FILE* file, std::uint64_t position)
{
    return _fseeki64(file, static_cast<long long>(position), SEEK_SET) == 0;
}

bool flush_to_disk(std::FILE* file)
{
    return std::fflush(file) == 0 && _commit(_fileno(file)) == 0;
}

#else

void* allocate_pages(std::size_t bytes, std::size_t alignment)
{
    void* memory = std::aligned_alloc(alignment, bytes);
#ifdef __linux__
    if (memory != nullptr)
        madvise(memory, bytes, MADV_HUGEPAGE);  // a hint, allowed to fail
#endif
    return memory;
}

void free_pages(void* memory)
{
    std::free(memory);
}

long process_id()
{
    return getpid();
}

bool may_write(const std::string& path)
{
    return access(path.c_str(), W_OK) == 0;
}

bool seek_file(std::FILE* file, std::uint64_t position)
{
    return fseeko(file, static_cast<off_t>(position), SEEK_SET) == 0;
}

bool flush_to_disk(std::FILE* file)
{
    // Pipes and some file systems have nothing to synchronize: EINVAL.
    return std::fflush(file) == 0 && (fsync(fileno(file)) == 0 || errno == EINVAL);
}

#endif

}  // namespace beamspread
