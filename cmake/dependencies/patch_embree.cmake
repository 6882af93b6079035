# Mends Embree's build where a TBB that it found by itself would be installed, and where Debian took a manual out.
cmake_minimum_required(VERSION 3.25)
file(WRITE common/cmake/installTBB.cmake "")
file(TOUCH readme.pdf)
