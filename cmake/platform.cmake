# Differences between operating systems, processors and compilers; native/base/platform.h has those of the code. Linux
# on x86-64 with GCC 12 is built and tested. The other branches follow documentation and have not run. Windows needs
# clang-cl, for GCC's vector types.
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
                         $<$<BOOL:${BEAMSPREAD_WERROR}>:-Werror> -fno-math-errno
                         # Modules link only the functions that they call.
                         -ffunction-sections -fdata-sections)
endif()
# Contraction to fused multiply-add would make results depend on the compiler's choices.
target_compile_options(beamspread_options INTERFACE ${as_clang}-ffp-contract=off)
if(linux AND x86_64)
  target_compile_options(beamspread_options INTERFACE "SHELL:-include ${CMAKE_SOURCE_DIR}/cmake/linux/oldest_glibc.h")
endif()

# GCC 12 copies even 32 bytes by "rep movs" in code for targets other than the command line's. Its order of instructions
# keeps too few of them in flight with 16 registers: the other options save 9 % of the walk with AVX2 and 13 % with
# SSE4, and cost 2 % with AVX-512.
if(x86_64 AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set_source_files_properties(native/transport/walk/walk_packets.cpp PROPERTIES COMPILE_OPTIONS
    "-mmemcpy-strategy=unrolled_loop:256:noalign,libcall:-1:noalign;-flive-range-shrinkage;-fschedule-insns;-fsched-pressure")
endif()

# Keeps a module apart from the libraries of its process: it exports its init function alone and carries its C++
# library.
function(beamspread_keep_apart target)
  if(linux)
    target_link_options(${target} PRIVATE -Wl,--version-script=${CMAKE_SOURCE_DIR}/cmake/linux/exports.map
                        -Wl,--exclude-libs,ALL -Wl,--gc-sections $<$<CONFIG:Release>:-Wl,--strip-all>)
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${CMAKE_SOURCE_DIR}/cmake/linux/exports.map)
    if(NOT BEAMSPREAD_SANITIZE)  # a sanitizer's run time looks for the functions of a shared libstdc++
      # libgcc_s stays the system's: GCC 12's static one needs glibc 2.35.
      target_link_options(${target} PRIVATE -static-libstdc++)
    endif()
  elseif(APPLE)
    # Python's symbols come from the process that loads it.
    target_link_options(${target} PRIVATE -undefined dynamic_lookup "-Wl,-exported_symbol,_PyInit_*")
  elseif(WIN32)
    target_link_libraries(${target} PRIVATE Python::Module)
  endif()
endfunction()
