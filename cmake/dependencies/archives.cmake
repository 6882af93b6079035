# The sources that the module is built with: Debian's archives of what each project published, and DUCC's
# and pybind11's packages from PyPI. Each is known by its sha256; what is in the folder already is not fetched again.
set(BEAMSPREAD_ARCHIVES_DIR "${BEAMSPREAD_DEPENDENCIES_DIR}/archives" CACHE PATH "Folder of the dependencies' archives")
set(debian_pool http://deb.debian.org/debian/pool/main)

# archive(NAME FILE SHA256 URL | PyPI package): sets NAME_archive to the file's path, and fetches it where it is missing.
function(archive name file sha256 from)
  set(path ${BEAMSPREAD_ARCHIVES_DIR}/${file})
  set(${name}_archive ${path} PARENT_SCOPE)
  set(${name}_sha256 ${sha256} PARENT_SCOPE)
  set_property(GLOBAL APPEND PROPERTY beamspread_archives ${sha256})
  if(EXISTS ${path})
    file(SHA256 ${path} found)
    if(found STREQUAL sha256)
      return()
    endif()
    file(REMOVE ${path})
  endif()
  message(STATUS "Fetching ${file}")
  file(MAKE_DIRECTORY ${BEAMSPREAD_ARCHIVES_DIR})
  if(from MATCHES "^http")
    foreach(attempt RANGE 1 3)
      file(DOWNLOAD ${from}/${file} ${path}.part STATUS status INACTIVITY_TIMEOUT 60)
      list(GET status 0 code)
      if(code EQUAL 0)
        break()
      endif()
    endforeach()
    list(GET status 1 problem)
    if(NOT code EQUAL 0)
      message(FATAL_ERROR "${from}/${file} could not be fetched (${problem}). Put the file into ${BEAMSPREAD_ARCHIVES_DIR}.")
    endif()
    file(RENAME ${path}.part ${path})
  else()
    # pip knows which index or mirror this machine uses. Debian's Python has none, tools/setup.sh's environment has.
    set(python ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../build/venv/bin/python)
    if(NOT EXISTS ${python})
      set(python ${Python_EXECUTABLE})
    endif()
    execute_process(COMMAND ${python} -m pip download --quiet --disable-pip-version-check --no-deps ${from}
                            --dest ${BEAMSPREAD_ARCHIVES_DIR} RESULT_VARIABLE code)
    if(NOT code EQUAL 0)
      message(FATAL_ERROR "pip could not fetch ${file}. Put the file into ${BEAMSPREAD_ARCHIVES_DIR}.")
    endif()
  endif()
  file(SHA256 ${path} found)
  if(NOT found STREQUAL sha256)
    message(FATAL_ERROR "${path} is not the file that it should be: its sha256 is ${found}, not ${sha256}")
  endif()
endfunction()

archive(tbb onetbb_2021.8.0.orig.tar.xz 7e9111b8bb59c8800bf6d0b06afe7b0891937443d2dae1ee1101c8e2ede6a7ef
        ${debian_pool}/o/onetbb)
archive(embree embree_3.13.5+dfsg.orig.tar.xz 1b7c5b6144230ad81b92ece884a2017fbbb433bf5416a6fca9257e0109501c63
        ${debian_pool}/e/embree)
archive(zlib zlib_1.3.dfsg+really1.3.1.orig.tar.gz 60dd315c07f616887caa029408308a018ace66e3d142726a97db164b3b8f69fb
        ${debian_pool}/z/zlib)
archive(imath imath_3.1.6.orig.tar.gz ea5592230f5ab917bea3ceab266cf38eb4aa4a523078d46eac0f5a89c52304db
        ${debian_pool}/i/imath)
archive(openexr openexr_3.1.5.orig.tar.gz 93925805c1fc4f8162b35f0ae109c4a75344e6decae5a240afdfce25f8a433ec
        ${debian_pool}/o/openexr)
archive(highway highway_1.0.3.orig.tar.gz 566fc77315878473d9a6bd815f7de78c73734acdcb745c3dde8579560ac5440e
        ${debian_pool}/h/highway)
archive(glm glm_0.9.9.8+ds.orig.tar.xz 0e678af38374a9d49dbd19f206bbc31564ddcd91449fe48ea8967a51ab3ccd69
        ${debian_pool}/g/glm)
archive(eigen eigen3_3.4.0.orig.tar.bz2 b4c198460eba6f28d34894e3a5710998818515104d6e74e5cc331ce31e46e626
        ${debian_pool}/e/eigen3)
archive(pybind11 pybind11-2.13.6-py3-none-any.whl 237c41e29157b962835d356b370ededd57594a26d5894a795960f0047cb5caf5
        pybind11==2.13.6)
archive(ducc ducc0-0.42.0.tar.gz 4e11c59b53a43355b053aebb2a62ee16eebeed026575f7d216cf09d437ce52ef
        "--no-binary;ducc0;ducc0==0.42.0")
