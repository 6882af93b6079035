# What is particular to an operating system, a processor or a compiler, beside native/base/platform.h. Built and tested:
# Linux on x86-64 with GCC 12. The other branches are written after documentation and have not run; on Windows the
# compiler has to be clang-cl, for GCC's vector types.
string(COMPARE EQUAL "${CMAKE_SYSTEM_NAME}" Linux linux)
set(x86_64 FALSE)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(x86_64 TRUE)
endif()

if(MSVC)
  set(as_clang /clang:)
  target_compile_options(beamspread_options INTERFACE /W4 $<$<BOOL:${BEAMSPREAD_WERROR}>:/WX>)
else()
  set(as_clang "")
  target_compile_options(beamspread_options INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow
                         $<$<BOOL:${BEAMSPREAD_WERROR}>:-Werror> -fno-math-errno)
endif()
# Contraction to fused multiply-add would make results depend on the compiler's choices.
target_compile_options(beamspread_options INTERFACE ${as_clang}-ffp-contract=off)
if(linux AND x86_64)
  target_compile_options(beamspread_options INTERFACE "SHELL:-include ${CMAKE_SOURCE_DIR}/cmake/linux/oldest_glibc.h")
endif()

# GCC 12 would copy even 32 bytes by "rep movs" in code for other targets than the command line's. Its order of
# instructions keeps too few of them in flight where there are only 16 registers: with AVX2 the other options save 9 %
# of the walk and with SSE4 13 %; with AVX-512 they cost 2 %.
if(x86_64 AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set_source_files_properties(native/transport/walk/walk_packets.cpp PROPERTIES COMPILE_OPTIONS
    "-mmemcpy-strategy=unrolled_loop:256:noalign,libcall:-1:noalign;-flive-range-shrinkage;-fschedule-insns;-fsched-pressure")
endif()

# For a module inside a process that has its own copies of many libraries: it exports nothing but its init function and
# carries its C++ library.
function(beamspread_keep_apart target)
  if(linux)
    target_link_options(${target} PRIVATE -Wl,--version-script=${CMAKE_SOURCE_DIR}/cmake/linux/exports.map
                        -Wl,--exclude-libs,ALL -Wl,--gc-sections $<$<CONFIG:Release>:-Wl,--strip-all>)
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${CMAKE_SOURCE_DIR}/cmake/linux/exports.map)
    if(NOT BEAMSPREAD_SANITIZE)  # a sanitizer's run time looks for the functions of a shared libstdc++
      # libgcc_s stays the system's: the one that GCC 12 links statically asks for glibc 2.35.
      target_link_options(${target} PRIVATE -static-libstdc++)
    endif()
  elseif(APPLE)
    # Python's symbols come from the process that loads it.
    target_link_options(${target} PRIVATE -undefined dynamic_lookup -Wl,-exported_symbol,_PyInit__native)
  elseif(WIN32)
    target_link_libraries(${target} PRIVATE Python::Module)
  endif()
endfunction()
