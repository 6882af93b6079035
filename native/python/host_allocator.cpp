// Sends every malloc and free of this module to the process's own allocator.
//
// The module is loaded with RTLD_DEEPBIND (addon/_load.py), so that its names resolve to its own
// dependencies first, libc among them. A host that brings another allocator (Debian's Blender: jemalloc)
// has it in the global scope, where libstdc++ and libc find it when they allocate on our behalf
// (__cxa_demangle, strdup); libc's free would then get memory that is not its own. The linker's --wrap
// (CMakeLists.txt) brings our calls here.
#include <dlfcn.h>

#include <cstddef>

namespace {

struct HostAllocator {
    void* (*malloc)(std::size_t);
    void* (*calloc)(std::size_t, std::size_t);
    void* (*realloc)(void*, std::size_t);
    void* (*aligned_alloc)(std::size_t, std::size_t);
    int (*posix_memalign)(void**, std::size_t, std::size_t);
    void (*free)(void*);
};

template <class Function>
void look_up(Function& function, void* process, const char* name)
{
    function = reinterpret_cast<Function>(dlsym(process, name));
}

const HostAllocator& host()
{
    static const HostAllocator allocator = [] {
        // The main program's handle searches the global scope; RTLD_DEFAULT would search ours first.
        void* process = dlopen(nullptr, RTLD_LAZY);
        HostAllocator found{};
        look_up(found.malloc, process, "malloc");
        look_up(found.calloc, process, "calloc");
        look_up(found.realloc, process, "realloc");
        look_up(found.aligned_alloc, process, "aligned_alloc");
        look_up(found.posix_memalign, process, "posix_memalign");
        look_up(found.free, process, "free");
        return found;
    }();
    return allocator;
}

}  // namespace

// The names are the linker's.
// NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-identifier-naming)
extern "C" {
void* __wrap_malloc(std::size_t size)
{
    return host().malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size)
{
    return host().calloc(count, size);
}
void* __wrap_realloc(void* memory, std::size_t size)
{
    return host().realloc(memory, size);
}
void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size)
{
    return host().aligned_alloc(alignment, size);
}
int __wrap_posix_memalign(void** memory, std::size_t alignment, std::size_t size)
{
    return host().posix_memalign(memory, alignment, size);
}
void __wrap_free(void* memory)
{
    host().free(memory);
}
}
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-identifier-naming)
