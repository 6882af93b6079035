# Mends Embree's build where a TBB that it found by itself would be installed, and where Debian took a manual out; leaves
# out how curves are traced, which is built even where there are no curves and takes half of the time.
cmake_minimum_required(VERSION 3.25)
file(WRITE common/cmake/installTBB.cmake "")
file(TOUCH readme.pdf)
file(READ kernels/CMakeLists.txt kernels)
string(REGEX REPLACE "geometry/curve_intersector_virtual_[0-9a-z_]+[.]cpp" "" kernels "${kernels}")
file(WRITE kernels/CMakeLists.txt "${kernels}")
