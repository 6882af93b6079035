# DUCC's FFT (BSD-3 part of its PyPI source package), compiled into one static library.
if(NOT EXISTS ${DUCC_SOURCE_DIR}/src/ducc0/fft/fft.h)
  message(FATAL_ERROR "DUCC's sources are not at ${DUCC_SOURCE_DIR}: run tools/setup.sh, or set DUCC_SOURCE_DIR")
endif()
set(ducc_src ${DUCC_SOURCE_DIR}/src)
add_library(beamspread_ducc STATIC
            ${ducc_src}/ducc0/fft/fft_inst1.cc ${ducc_src}/ducc0/fft/fft_inst2.cc ${ducc_src}/ducc0/infra/mav.cc
            ${ducc_src}/ducc0/infra/string_utils.cc ${ducc_src}/ducc0/infra/threading.cc)
target_include_directories(beamspread_ducc SYSTEM PUBLIC ${ducc_src})
# Threads are ours (base/threads.h): a guest in another process brings no pool of its own. DUCC's own switch for that,
# DUCC0_NO_LOWLEVEL_THREADING, would also take the locks off the plans that our threads share.
target_compile_definitions(beamspread_ducc PUBLIC DUCC0_CUSTOM_LOWLEVEL_THREADING)
target_include_directories(beamspread_ducc SYSTEM PUBLIC ${CMAKE_SOURCE_DIR}/cmake/ducc)
target_compile_options(beamspread_ducc PRIVATE -w -O3)
if(BEAMSPREAD_SANITIZE)
  # Minutes to compile otherwise, and not what a sanitizer is here to check.
  target_compile_options(beamspread_ducc PRIVATE -fno-sanitize=all)
endif()
