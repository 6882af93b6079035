#include "image/exr_header.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFloatVectorAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfStringVectorAttribute.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <type_traits>
#include <utility>

namespace beamspread::detail {

namespace {

// The attributes that OpenEXR itself gives a meaning and a type.
constexpr std::array<std::string_view, 17> structural_attributes{
    "channels",        "chromaticities",    "chunkCount",        "compression",       "dataWindow", "displayWindow",
    "dwaCompressionLevel", "lineOrder",     "maxSamplesPerPixel", "name",             "pixelAspectRatio",
    "screenWindowCenter", "screenWindowWidth", "tiles",          "timeCode",          "type",       "version"};

// (layer, rank within the layer, name): sorts "A B G R" into "R G B A" and keeps layers together.
std::pair<std::string, std::pair<std::size_t, std::string>> conventional_rank(const std::string& channel)
{
    constexpr std::string_view first = "RGBA";
    const std::size_t dot = channel.rfind('.');
    const std::size_t start = dot == std::string::npos ? 0 : dot + 1;
    const std::string layer = channel.substr(0, start);
    const std::string base = channel.substr(start);
    const std::size_t rank = base.size() == 1 ? std::min(first.find(base[0]), first.size()) : first.size();
    return {layer, {rank, channel}};
}

}  // namespace

bool is_structural_attribute(const std::string& name)
{
    return name == channel_order_attribute ||
           std::find(structural_attributes.begin(), structural_attributes.end(), name) != structural_attributes.end();
}

void set_attributes(Imf::Header& header, const std::map<std::string, ExrAttribute>& attributes)
{
    for (const auto& [name, attribute] : attributes) {
        std::visit(
            [&header, &key = name](const auto& value) {
                header.insert(key, Imf::TypedAttribute<std::decay_t<decltype(value)>>(value));
            },
            attribute);
    }
}

std::map<std::string, ExrAttribute> get_attributes(const Imf::Header& header)
{
    std::map<std::string, ExrAttribute> attributes;
    for (auto entry = header.begin(); entry != header.end(); ++entry) {
        const std::string name = entry.name();
        if (is_structural_attribute(name))
            continue;
        const Imf::Attribute& attribute = entry.attribute();
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute))
            attributes.emplace(name, text->value());
        else if (const auto* number = dynamic_cast<const Imf::DoubleAttribute*>(&attribute))
            attributes.emplace(name, number->value());
        else if (const auto* single = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
            attributes.emplace(name, static_cast<double>(single->value()));
        else if (const auto* integer = dynamic_cast<const Imf::IntAttribute*>(&attribute))
            attributes.emplace(name, integer->value());
        else if (const auto* list = dynamic_cast<const Imf::FloatVectorAttribute*>(&attribute))
            attributes.emplace(name, static_cast<const std::vector<float>&>(list->value()));
    }
    return attributes;
}

void set_channels(Imf::Header& header, const std::vector<std::string>& channels)
{
    for (const std::string& channel : channels)
        header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    header.insert(channel_order_attribute, Imf::StringVectorAttribute(channels));
}

std::vector<std::string> get_channels(const Imf::Header& header)
{
    std::vector<std::string> channels;
    for (auto entry = header.channels().begin(); entry != header.channels().end(); ++entry)
        channels.emplace_back(entry.name());

    // Another program may have kept the attribute and changed the channels: it counts only if it names the same ones.
    const auto* order = header.findTypedAttribute<Imf::StringVectorAttribute>(channel_order_attribute);
    if (order && order->value().size() == channels.size() &&
        std::is_permutation(channels.begin(), channels.end(), order->value().begin()))
        return order->value();

    std::sort(channels.begin(), channels.end(), [](const std::string& left, const std::string& right) {
        return conventional_rank(left) < conventional_rank(right);
    });
    return channels;
}

}  // namespace beamspread::detail
