# The module. That of the Python that builds goes into the stage. For the package the target `modules` makes one module
# for all Pythons with headers at hand. (Python's stable interface would do so by itself, but binding libraries know it
# from Python 3.12 on, and most Blenders are older.)
option(BEAMSPREAD_FETCH_PYTHON_HEADERS "Fetch headers of further Pythons (tools/python_headers.sh)" OFF)
if(BEAMSPREAD_FETCH_PYTHON_HEADERS)
  execute_process(COMMAND ${CMAKE_SOURCE_DIR}/tools/python_headers.sh ${BEAMSPREAD_DEPENDENCIES_DIR}/python)
endif()
# A list of folders with headers; given on the command line, or found.
if(NOT DEFINED BEAMSPREAD_OTHER_PYTHONS)
  file(GLOB BEAMSPREAD_OTHER_PYTHONS ${BEAMSPREAD_DEPENDENCIES_DIR}/python/usr/include/python3.*)
endif()
file(GLOB python_sources CONFIGURE_DEPENDS native/python/*.cpp)

# python_bindings(TARGET INCLUDES...): object files of the bindings for the Python of these headers.
function(python_bindings target)
  add_library(${target} OBJECT EXCLUDE_FROM_ALL ${python_sources})
  target_link_libraries(${target} PRIVATE ${beamspread_libraries})
  target_include_directories(${target} SYSTEM PRIVATE ${ARGN})
  target_compile_definitions(${target} PRIVATE BEAMSPREAD_VERSION="${PROJECT_VERSION}")
  # Bindings convert arguments and call the libraries: small code counts, since a package has it for each Python.
  if(NOT MSVC)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Os>)
  endif()
  if(linux AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -fno-gnu-unique)  # unique symbols could not become local
  endif()
  # Reading headers takes most of the compilation. (The preset `dev` compiles each file by itself, for clang-tidy.)
  if(NOT DEFINED CMAKE_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
  endif()
endfunction()

# python_module(TARGET SUFFIX FOLDER SOURCES...)
function(python_module target suffix folder)
  add_library(${target} MODULE ${ARGN})
  target_link_libraries(${target} PRIVATE ${beamspread_libraries})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME _native SUFFIX .${suffix}
                        LIBRARY_OUTPUT_DIRECTORY ${folder} LINKER_LANGUAGE CXX)
  beamspread_keep_apart(${target})
endfunction()

execute_process(COMMAND ${Python_EXECUTABLE} -c "import sysconfig; print(sysconfig.get_config_var('EXT_SUFFIX'))"
                OUTPUT_VARIABLE suffix OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(SUBSTRING ${suffix} 1 -1 own_tag)
set(own_digits ${Python_VERSION_MAJOR}${Python_VERSION_MINOR})
python_bindings(bindings_${own_digits} ${Python_INCLUDE_DIRS})
python_module(_native ${own_tag} ${BEAMSPREAD_STAGE_DIR}/beamspread $<TARGET_OBJECTS:bindings_${own_digits}>)
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

set(all_digits ${own_digits})
foreach(includes IN LISTS BEAMSPREAD_OTHER_PYTHONS)
  file(STRINGS ${includes}/patchlevel.h version REGEX "#define PY_(MAJOR|MINOR)_VERSION")
  string(REGEX REPLACE "[^0-9]*([0-9]+);[^0-9]*([0-9]+)" "\\1\\2" digits "${version}")
  if(NOT digits IN_LIST all_digits)
    python_bindings(bindings_${digits} ${includes} ${includes}/..)
    list(APPEND all_digits ${digits})
  endif()
endforeach()
list(SORT all_digits)

add_custom_target(modules)
if(NOT linux)
  # Further modules, one per Python; the tag in a file's name tells its Python.
  add_dependencies(modules _native)
  foreach(digits IN LISTS all_digits)
    if(NOT digits STREQUAL own_digits)
      string(REGEX REPLACE "(cpython-|cp)[0-9]+" "\\1${digits}" tag ${own_tag})
      python_module(_native_${digits} ${tag} ${CMAKE_BINARY_DIR}/modules $<TARGET_OBJECTS:bindings_${digits}>)
      set_target_properties(_native_${digits} PROPERTIES EXCLUDE_FROM_ALL ON)
      add_dependencies(modules _native_${digits})
    endif()
  endforeach()
  return()
endif()
# One module holds the libraries once and the bindings for each Python; every Python takes a file without a tag. The
# bindings contain the same templates for different layouts of Python's objects. Like DUCC's variants (ducc.cmake), those
# for one Python are therefore linked into one object file that shows its entry alone. Python's functions are weak,
# since no Python has those of all.
set(python_objects)
set(python_macro)
foreach(digits IN LISTS all_digits)
  set(object ${CMAKE_BINARY_DIR}/bindings_${digits}.o)
  add_custom_command(OUTPUT ${object}
                     COMMAND ${CMAKE_LINKER} -r --force-group-allocation -o ${object} $<TARGET_OBJECTS:bindings_${digits}>
                     COMMAND ${CMAKE_OBJCOPY} --redefine-sym=PyInit__native=PyInit__native_${digits} ${object}
                     COMMAND ${CMAKE_OBJCOPY} --keep-global-symbol=PyInit__native_${digits} ${object}
                     COMMAND ${CMAKE_OBJCOPY} --wildcard --weaken-symbol=Py* --weaken-symbol=_Py* ${object}
                     DEPENDS bindings_${digits} $<TARGET_OBJECTS:bindings_${digits}>
                     COMMAND_EXPAND_LISTS VERBATIM)
  list(APPEND python_objects ${object})
  string(REGEX REPLACE "^3" "" minor ${digits})
  string(APPEND python_macro "BEAMSPREAD_PYTHON(${minor})")
endforeach()
python_module(_native_of_all so ${CMAKE_BINARY_DIR}/modules native/python/choice/choose_python.cpp ${python_objects})
target_include_directories(_native_of_all SYSTEM PRIVATE ${Python_INCLUDE_DIRS})
target_compile_definitions(_native_of_all PRIVATE BEAMSPREAD_PYTHONS=${python_macro})
set_target_properties(_native_of_all PROPERTIES EXCLUDE_FROM_ALL ON)
add_dependencies(modules _native_of_all)
