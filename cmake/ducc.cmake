# DUCC's FFT (BSD-3 part of its PyPI source package), compiled for several instruction sets into one static library.
set(ducc_src ${BEAMSPREAD_DEPENDENCIES}/include)

# The linker merges templates and inline functions of one name, so code for a newer processor could end up in the rest
# of the program, even though all of it is static and hidden. Each variant is therefore linked into one object file:
# --force-group-allocation dissolves the groups that linkers merge, and all symbols but its entry become local (unique
# symbols could not). Only Linux's linker does that; other systems have the baseline alone.
set(ducc_objects)
function(ducc_instruction_set name)
  add_library(ducc_${name} OBJECT ${CMAKE_SOURCE_DIR}/native/fft/instruction_sets/instruction_set.cpp ${ducc_src}/ducc0/infra/mav.cc
              ${ducc_src}/ducc0/infra/string_utils.cc ${ducc_src}/ducc0/infra/threading.cc)
  target_include_directories(ducc_${name} PRIVATE ${CMAKE_SOURCE_DIR}/native)
  # base/threads.h provides threads: a guest in another process brings no pool. DUCC's switch
  # DUCC0_NO_LOWLEVEL_THREADING would also remove the locks of the plans that our threads share.
  target_include_directories(ducc_${name} SYSTEM PRIVATE ${ducc_src} ${CMAKE_SOURCE_DIR}/cmake/ducc)
  target_compile_definitions(ducc_${name} PRIVATE DUCC0_CUSTOM_LOWLEVEL_THREADING
                             BEAMSPREAD_FFT_INSTRUCTION_SET=beamspread_fft_${name})
  target_compile_options(ducc_${name} PRIVATE -w -O3 -fno-gnu-unique ${ARGN})
  if(BEAMSPREAD_SANITIZE)
    # A sanitizer would take minutes to compile DUCC, which is not under test.
    target_compile_options(ducc_${name} PRIVATE -fno-sanitize=all)
  endif()
  if(NOT linux)
    set(ducc_objects ${ducc_objects} $<TARGET_OBJECTS:ducc_${name}> PARENT_SCOPE)
    return()
  endif()
  set(object ${CMAKE_BINARY_DIR}/ducc_${name}.o)
  add_custom_command(OUTPUT ${object}
                     COMMAND ${CMAKE_LINKER} -r --force-group-allocation -o ${object} $<TARGET_OBJECTS:ducc_${name}>
                     COMMAND ${CMAKE_OBJCOPY} --keep-global-symbol=beamspread_fft_${name} ${object}
                     DEPENDS ducc_${name} $<TARGET_OBJECTS:ducc_${name}>
                     COMMAND_EXPAND_LISTS VERBATIM)
  set(ducc_objects ${ducc_objects} ${object} PARENT_SCOPE)
endfunction()

if(linux AND x86_64)
  # Code is small where there is a faster variant. With -O2 the AVX-512 variant is a third smaller, and transforms take
  # 1.1 times as long.
  ducc_instruction_set(baseline -Os)
  ducc_instruction_set(avx2 -march=x86-64-v3 -O2)
  ducc_instruction_set(avx512 -march=x86-64-v4)
else()
  ducc_instruction_set(baseline)
endif()
list(LENGTH ducc_objects ducc_instruction_set_count)
add_library(beamspread_ducc STATIC ${ducc_objects})
set_target_properties(beamspread_ducc PROPERTIES LINKER_LANGUAGE CXX)
if(ducc_instruction_set_count GREATER 1)
  target_compile_definitions(beamspread_ducc INTERFACE BEAMSPREAD_FFT_INSTRUCTION_SETS)
endif()
