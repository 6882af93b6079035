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
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>

namespace beamspread::detail {

namespace {

// Attributes with a meaning and a type in OpenEXR itself.
constexpr std::array<std::string_view, 17> structural_attributes{"channels",
                                                                 "chromaticities",
                                                                 "chunkCount",
                                                                 "compression",
                                                                 "dataWindow",
                                                                 "displayWindow",
                                                                 "dwaCompressionLevel",
                                                                 "lineOrder",
                                                                 "maxSamplesPerPixel",
                                                                 "name",
                                                                 "pixelAspectRatio",
                                                                 "screenWindowCenter",
                                                                 "screenWindowWidth",
                                                                 "tiles",
                                                                 "timeCode",
                                                                 "type",
                                                                 "version"};

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

// RFC 3629: no surrogates and no overlong forms.
bool is_utf8(std::string_view text)
{
    constexpr std::array<std::uint32_t, 3> smallest{0x80, 0x800, 0x10000};
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto lead = static_cast<unsigned char>(text[i]);
        if (lead < 0x80)
            continue;
        const std::size_t following = lead >= 0xf0 ? 3 : lead >= 0xe0 ? 2 : 1;
        if (lead < 0xc2 || lead > 0xf4 || following >= text.size() - i)
            return false;
        std::uint32_t code = lead & (0x3fu >> following);
        for (std::size_t k = 0; k < following; ++k) {
            const auto next = static_cast<unsigned char>(text[++i]);
            if ((next & 0xc0) != 0x80)
                return false;
            code = code << 6 | (next & 0x3fu);
        }
        if (code < smallest[following - 1] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000))
            return false;
    }
    return true;
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
        const std::string name = as_utf8(entry.name());
        if (is_structural_attribute(name))
            continue;
        const Imf::Attribute& attribute = entry.attribute();
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute))
            attributes.emplace(name, as_utf8(text->value()));
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

void set_channels(Imf::Header& header, const std::vector<std::string>& channels, Imf::PixelType type)
{
    for (const std::string& channel : channels)
        header.channels().insert(channel, Imf::Channel(type));
    header.insert(channel_order_attribute, Imf::StringVectorAttribute(channels));
}

std::vector<std::string> get_channels(const Imf::Header& header)
{
    std::vector<std::string> channels;
    for (auto entry = header.channels().begin(); entry != header.channels().end(); ++entry)
        channels.emplace_back(entry.name());

    // Another program may have copied the attribute and changed the channels: the order counts only for the same
    // channels.
    const auto* order = header.findTypedAttribute<Imf::StringVectorAttribute>(channel_order_attribute);
    if (order && order->value().size() == channels.size() &&
        std::is_permutation(channels.begin(), channels.end(), order->value().begin()))
        return order->value();

    std::sort(channels.begin(), channels.end(), [](const std::string& left, const std::string& right) {
        return conventional_rank(left) < conventional_rank(right);
    });
    return channels;
}

bool is_half(const Imf::Header& header)
{
    for (auto entry = header.channels().begin(); entry != header.channels().end(); ++entry)
        if (entry.channel().type != Imf::HALF)
            return false;
    return true;
}

std::string as_utf8(std::string text)
{
    if (!is_utf8(text))
        std::replace_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; }, '?');
    return text;
}

std::string reason_of(const std::exception& error, const std::string& path)
{
    // "Cannot read image file "PATH". Reason"
    const std::string message = as_utf8(error.what());
    const std::string mention = "\"" + path + "\". ";
    const std::size_t at = message.find(mention);
    return at == std::string::npos ? message : message.substr(at + mention.size());
}

}  // namespace beamspread::detail
