# The module, once per Python; all link the same libraries. The module of the Python that builds goes into the stage.
# The target `modules` makes those of other Pythons with headers at hand, for the package; the tag in a file's name
# tells its Python. (Python's stable interface would need one file, but binding libraries know it from Python 3.12 on,
# and most Blenders are older.)
option(BEAMSPREAD_FETCH_PYTHON_HEADERS "Fetch headers of further Pythons (tools/python_headers.sh)" OFF)
if(BEAMSPREAD_FETCH_PYTHON_HEADERS)
  execute_process(COMMAND ${CMAKE_SOURCE_DIR}/tools/python_headers.sh ${BEAMSPREAD_DEPENDENCIES_DIR}/python)
endif()
# A list of folders with headers; given on the command line, or found.
if(NOT DEFINED BEAMSPREAD_OTHER_PYTHONS)
  file(GLOB BEAMSPREAD_OTHER_PYTHONS ${BEAMSPREAD_DEPENDENCIES_DIR}/python/usr/include/python3.*)
endif()
file(GLOB python_sources CONFIGURE_DEPENDS native/python/*.cpp)

# python_module(TARGET TAG FOLDER INCLUDES...)
function(python_module target tag folder)
  add_library(${target} MODULE ${python_sources})
  target_link_libraries(${target} PRIVATE ${beamspread_libraries})
  target_include_directories(${target} SYSTEM PRIVATE ${ARGN})
  target_compile_definitions(${target} PRIVATE BEAMSPREAD_VERSION="${PROJECT_VERSION}")
  # Bindings convert arguments and call the libraries: small code counts, since a package has it for each Python.
  if(NOT MSVC)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Os>)
  endif()
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME _native SUFFIX .${tag}
                        LIBRARY_OUTPUT_DIRECTORY ${folder})
  # Reading headers takes most of the compilation. (The preset `dev` compiles each file by itself, for clang-tidy.)
  if(NOT DEFINED CMAKE_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
  endif()
  beamspread_keep_apart(${target})
endfunction()

execute_process(COMMAND ${Python_EXECUTABLE} -c "import sysconfig; print(sysconfig.get_config_var('EXT_SUFFIX'))"
                OUTPUT_VARIABLE suffix OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(SUBSTRING ${suffix} 1 -1 own_tag)
python_module(_native ${own_tag} ${BEAMSPREAD_STAGE_DIR}/beamspread ${Python_INCLUDE_DIRS})
# Functions that tests alone call, beside the staged package: neither the zip nor the wheel has them.
add_library(_native_test MODULE tests/native_test.cpp tests/native_surface.cpp native/python/casters.cpp)
target_link_libraries(_native_test PRIVATE ${beamspread_libraries})
target_include_directories(_native_test SYSTEM PRIVATE ${Python_INCLUDE_DIRS})
set_target_properties(_native_test PROPERTIES PREFIX "" SUFFIX .${own_tag}
                      LIBRARY_OUTPUT_DIRECTORY ${BEAMSPREAD_STAGE_DIR})
beamspread_keep_apart(_native_test)
# Types for editors and type checkers. A module with a sanitizer can't be imported to ask for them.
get_filename_component(python_folder ${Python_EXECUTABLE} DIRECTORY)
find_program(PYBIND11_STUBGEN pybind11-stubgen HINTS ${python_folder} ${CMAKE_SOURCE_DIR}/build/venv/bin)
if(PYBIND11_STUBGEN AND NOT BEAMSPREAD_SANITIZE)
  add_custom_command(TARGET _native POST_BUILD
                     COMMAND ${CMAKE_COMMAND} -DSTUBGEN=${PYBIND11_STUBGEN} -DFOLDER=${BEAMSPREAD_STAGE_DIR}/beamspread
                             -P ${CMAKE_SOURCE_DIR}/cmake/stubs.cmake VERBATIM)
  install(FILES ${BEAMSPREAD_STAGE_DIR}/beamspread/_native.pyi DESTINATION beamspread COMPONENT python)
endif()
# The files that pip installs.
install(TARGETS _native LIBRARY DESTINATION beamspread COMPONENT python)
install(DIRECTORY addon/ DESTINATION beamspread COMPONENT python PATTERN __pycache__ EXCLUDE PATTERN "*.pyc" EXCLUDE)
install(DIRECTORY ${BEAMSPREAD_DEPENDENCIES}/licenses DESTINATION beamspread COMPONENT python)
add_custom_target(modules DEPENDS _native)
foreach(includes IN LISTS BEAMSPREAD_OTHER_PYTHONS)
  file(STRINGS ${includes}/patchlevel.h version REGEX "#define PY_(MAJOR|MINOR)_VERSION")
  string(REGEX REPLACE "[^0-9]*([0-9]+);[^0-9]*([0-9]+)" "\\1\\2" digits "${version}")
  string(REGEX REPLACE "cpython-[0-9]+" cpython-${digits} tag ${own_tag})
  if(NOT tag STREQUAL own_tag)
    python_module(_native_${digits} ${tag} ${CMAKE_BINARY_DIR}/modules ${includes} ${includes}/..)
    set_target_properties(_native_${digits} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(modules _native_${digits})
  endif()
endforeach()
