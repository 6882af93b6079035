# Mends Embree's build where a TBB that it found by itself would be installed, and where Debian took a manual out; leaves
# out how curves are made and traced, which is built even where there are no curves and takes more than half of the time,
# and hierarchies that an application builds for itself.
cmake_minimum_required(VERSION 3.25)
file(WRITE common/cmake/installTBB.cmake "")
file(TOUCH readme.pdf)
file(READ kernels/CMakeLists.txt kernels)
foreach(source geometry/curve_intersector_virtual_[0-9a-z_]+ common/scene_curves common/rtcore_builder)
  string(REGEX REPLACE "${source}[.]cpp" "" kernels "${kernels}")
endforeach()
file(WRITE kernels/CMakeLists.txt "${kernels}")
