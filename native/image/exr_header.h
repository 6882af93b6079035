// Attributes and channels of OpenEXR headers, for the reader and the writer of native/image alone.
#pragma once

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPixelType.h>

#include <exception>

#include "image/exr.h"

namespace beamspread::detail {

// Attribute with the order of the channels, because the format sorts them by name.
inline constexpr const char* channel_order_attribute = "channelOrder";

// True for attributes that describe the image itself. ExrPart::attributes never has them.
bool is_structural_attribute(const std::string& name);

void set_attributes(Imf::Header& header, const std::map<std::string, ExrAttribute>& attributes);
std::map<std::string, ExrAttribute> get_attributes(const Imf::Header& header);

void set_channels(Imf::Header& header, const std::vector<std::string>& channels, Imf::PixelType type);

// Names as the file spells them, in the order in which they were written. Files of other programs do not tell: there R,
// G, B, A come first within each layer, then the rest by name.
std::vector<std::string> get_channels(const Imf::Header& header);

// True if all channels have 16 bits.
bool is_half(const Imf::Header& header);

// The text if it is valid UTF-8, else with "?" for its bytes outside ASCII: hosts such as Python take nothing else.
std::string as_utf8(std::string text);

// OpenEXR's message about a fault, without its mention of the file's path.
std::string reason_of(const std::exception& error, const std::string& path);

}  // namespace beamspread::detail
