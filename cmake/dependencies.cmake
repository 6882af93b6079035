# Builds the static libraries of cmake/dependencies once per compiler, and lets find_package find no others.
set(BEAMSPREAD_DEPENDENCIES_DIR "${CMAKE_SOURCE_DIR}/build/deps" CACHE PATH "Folder that keeps the dependencies")
include(${CMAKE_CURRENT_LIST_DIR}/dependencies/archives.cmake)

set(recipe "")
foreach(file CMakeLists.txt patch_embree.cmake)
  file(READ ${CMAKE_CURRENT_LIST_DIR}/dependencies/${file} text)
  string(APPEND recipe "${text}")
endforeach()
get_property(archives GLOBAL PROPERTY beamspread_archives)
string(SHA256 key "${recipe} ${archives} ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_SYSTEM_PROCESSOR}")
string(SUBSTRING ${key} 0 12 key)
set(BEAMSPREAD_DEPENDENCIES ${BEAMSPREAD_DEPENDENCIES_DIR}/${key})
# Several folders may build at the same time.
file(LOCK ${BEAMSPREAD_DEPENDENCIES_DIR}/lock GUARD FILE)
if(NOT EXISTS ${BEAMSPREAD_DEPENDENCIES}/.complete)
  message(STATUS "Building the dependencies in ${BEAMSPREAD_DEPENDENCIES} (some minutes, once)")
  set(build ${BEAMSPREAD_DEPENDENCIES_DIR}/build)
  file(REMOVE_RECURSE ${BEAMSPREAD_DEPENDENCIES})
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/dependencies -B ${build} -G Ninja
                          -DCMAKE_INSTALL_PREFIX=${BEAMSPREAD_DEPENDENCIES} -DCMAKE_C_COMPILER=${CMAKE_C_COMPILER}
                          -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} -DCMAKE_C_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
                          -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER} -DPython_EXECUTABLE=${Python_EXECUTABLE}
                          -DBEAMSPREAD_ARCHIVES_DIR=${BEAMSPREAD_ARCHIVES_DIR} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${CMAKE_COMMAND} --build ${build} COMMAND_ERROR_IS_FATAL ANY)
  file(REMOVE_RECURSE ${build})
  file(TOUCH ${BEAMSPREAD_DEPENDENCIES}/.complete)
endif()
list(PREPEND CMAKE_PREFIX_PATH ${BEAMSPREAD_DEPENDENCIES})
# Highway installs no configuration for CMake.
find_library(BEAMSPREAD_HIGHWAY hwy PATHS ${BEAMSPREAD_DEPENDENCIES}/lib NO_DEFAULT_PATH REQUIRED)
add_library(beamspread_highway INTERFACE)
target_link_libraries(beamspread_highway INTERFACE ${BEAMSPREAD_HIGHWAY})
