# The module, once per Python; all link the same libraries. The one of the Python that builds goes into the stage.
# Those of other Pythons whose headers are there are made by the target `modules`, for the package, where they lie
# beside it, each named by the tag that its Python looks for. (Python's stable interface would make one file of them,
# but binding libraries know it from Python 3.12 on, and most Blenders have an older one.)
option(BEAMSPREAD_FETCH_PYTHON_HEADERS "Fetch headers of further Pythons (tools/python_headers.sh)" OFF)
if(BEAMSPREAD_FETCH_PYTHON_HEADERS)
  execute_process(COMMAND ${CMAKE_SOURCE_DIR}/tools/python_headers.sh ${BEAMSPREAD_DEPENDENCIES_DIR}/python)
endif()
# Or given: a list of folders with headers.
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
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME _native SUFFIX .${tag}
                        LIBRARY_OUTPUT_DIRECTORY ${folder})
  # Most of its compilation is reading headers. (clang-tidy wants to see each file by itself: the preset `dev`.)
  if(NOT DEFINED CMAKE_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
  endif()
  beamspread_keep_apart(${target})
endfunction()

execute_process(COMMAND ${Python_EXECUTABLE} -c "import sysconfig; print(sysconfig.get_config_var('EXT_SUFFIX'))"
                OUTPUT_VARIABLE suffix OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(SUBSTRING ${suffix} 1 -1 own_tag)
python_module(_native ${own_tag} ${BEAMSPREAD_STAGE_DIR}/beamspread ${Python_INCLUDE_DIRS})
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
