// Embree behind one header: handles that release themselves. Only occluders.cpp and triangle_set include it.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <type_traits>

namespace beamspread::embree {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};

using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;

// Throws std::runtime_error if the device has a pending error.
void check(RTCDevice device);

}  // namespace beamspread::embree
