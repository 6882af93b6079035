#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>

#include <new>
#include <set>
#include <stdexcept>

#include "base/error.h"
#include "image/exr.h"
#include "image/exr_header.h"
#include "image/pending_file.h"

namespace beamspread {

namespace {

// The format's limit for the names of channels and attributes.
constexpr std::size_t max_name_length = 255;

void check_name(const std::string& argument, const std::string& name)
{
    if (name.empty() || name.size() > max_name_length || name.find('\0') != std::string::npos)
        reject(argument, "'" + name + "'", "1 to 255 characters");
}

void check_part(const ExrPart& part, std::size_t pixel_values)
{
    if (part.width < 1 || part.width > max_exr_side)
        reject("width", part.width, "1 to " + std::to_string(max_exr_side) + " texels");
    if (part.height < 1 || part.height > max_exr_side)
        reject("height", part.height, "1 to " + std::to_string(max_exr_side) + " texels");
    if (part.channels.empty())
        reject("channels", "empty", "at least one name");
    for (const std::string& channel : part.channels)
        check_name("channels", channel);
    if (std::set<std::string>(part.channels.begin(), part.channels.end()).size() != part.channels.size())
        reject("channels", "a list with equal names", "names that differ");

    const std::size_t values =
        static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height) * part.channels.size();
    if (values > static_cast<std::size_t>(max_exr_values))
        reject("pixels", static_cast<double>(values), "at most 2^30 numbers");
    if (pixel_values != values)
        reject("pixels", std::to_string(pixel_values) + " numbers",
               std::to_string(values) + ", height * width * channels");

    for (const auto& [name, value] : part.attributes) {
        check_name("attributes", name);
        if (detail::is_structural_attribute(name))
            reject("attributes", "'" + name + "'", "names that OpenEXR does not use itself");
    }
}

void check_parts(std::span<const ExrPart> parts)
{
    if (parts.empty())
        reject("parts", "empty", "at least one part");
    std::set<std::string> names;
    for (const ExrPart& part : parts) {
        check_part(part, part.pixels.size());
        if (parts.size() > 1)
            check_name("name", part.name);
        if (!names.insert(part.name).second)
            reject("name", "'" + part.name + "' twice", "part names that differ");
    }
}

Imf::Header make_header(const ExrPart& part, const Imath::Box2i& display_window, ExrCompression compression)
{
    const Imath::Box2i data_window({0, 0}, {part.width - 1, part.height - 1});
    Imf::Header header(display_window, data_window);
    header.compression() = compression == ExrCompression::zip ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
    header.setType(Imf::SCANLINEIMAGE);
    if (!part.name.empty())
        header.setName(part.name);
    detail::set_channels(header, part.channels, part.half ? Imf::HALF : Imf::FLOAT);
    detail::set_attributes(header, part.attributes);
    return header;
}

template <class T>
void write_pixels(Imf::OutputPart output, const ExrPart& part, Imf::PixelType type, std::span<const T> pixels,
                  bool goes_up)
{
    const std::size_t pixel_bytes = part.channels.size() * sizeof(T);
    const std::size_t values = part.channels.size() * static_cast<std::size_t>(part.width);
    const T* first_line = pixels.data() + (goes_up ? pixels.size() - values : 0);
    // OpenEXR only adds strides to addresses: a stride that wraps around goes back. Blender writes its files this way.
    const std::size_t line_bytes = (goes_up ? 0 - values : values) * sizeof(T);
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < part.channels.size(); ++c)
        buffer.insert(part.channels[c],
                      Imf::Slice::Make(type, first_line + c, output.header().dataWindow(), pixel_bytes, line_bytes));
    output.setFrameBuffer(buffer);
    output.writePixels(part.height);
}

// `bottom_up`, unless it is empty, replaces the part's pixels.
void write_part(const Imf::OutputPart& output, const ExrPart& part, std::span<const float> bottom_up)
{
    const bool goes_up = !bottom_up.empty();
    const std::span<const float> pixels = goes_up ? bottom_up : part.pixels;
    if (part.half)
        write_pixels<half>(output, part, Imf::HALF, std::vector<half>(pixels.begin(), pixels.end()), goes_up);
    else
        write_pixels(output, part, Imf::FLOAT, pixels, goes_up);
}

// Passes the bytes of OpenEXR on to the pending file.
class PendingStream final : public Imf::OStream {
public:
    explicit PendingStream(PendingFile& file) : OStream(file.path().c_str()), m_file(file) {}

    void write(const char* data, int count) override { m_file.write(data, static_cast<std::size_t>(count)); }
    std::uint64_t tellp() override { return m_file.position(); }
    void seekp(std::uint64_t position) override { m_file.seek(position); }

private:
    PendingFile& m_file;
};

// Destructors of OpenEXR write the table of line offsets and swallow every exception, that of a failed allocation too:
// a file with a gap in its tables is incomplete.
void check_complete(const PendingFile& file, std::size_t parts)
{
    constexpr int no_pool = 0;  // OpenEXR's thread pool is global state of the host's process
    constexpr bool reconstruct = false;
    const Imf::MultiPartInputFile written(file.path().c_str(), no_pool, reconstruct);
    for (std::size_t i = 0; i < parts; ++i)
        if (!written.partComplete(static_cast<int>(i)))
            throw std::runtime_error("its table of lines is incomplete");
}

void write_file(const std::string& path, std::span<const ExrPart> parts, ExrCompression compression,
                std::span<const float> bottom_up)
{
    // The format wants one display window for all parts.
    Imath::Box2i display_window({0, 0}, {0, 0});
    for (const ExrPart& part : parts)
        display_window.extendBy(Imath::V2i(part.width - 1, part.height - 1));
    std::vector<Imf::Header> headers;
    for (const ExrPart& part : parts)
        headers.push_back(make_header(part, display_window, compression));

    PendingFile file(path);
    try {
        {
            constexpr int no_pool = 0;
            PendingStream stream(file);
            Imf::MultiPartOutputFile output(stream, headers.data(), static_cast<int>(headers.size()), false, no_pool);
            for (std::size_t i = 0; i < parts.size(); ++i)
                write_part(Imf::OutputPart(output, static_cast<int>(i)), parts[i], bottom_up);
        }
        file.close();
        check_complete(file, parts.size());
    } catch (const IoError&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw IoError("cannot write '" + path + "': " + detail::reason_of(error, file.path()));
    }
    file.commit();
}

}  // namespace

void write_exr_parts(const std::string& path, std::span<const ExrPart> parts, ExrCompression compression)
{
    check_parts(parts);
    write_file(path, parts, compression, {});
}

void write_exr_bottom_up(const std::string& path, const ExrPart& part, std::span<const float> pixels,
                         ExrCompression compression)
{
    check_part(part, pixels.size());
    write_file(path, {&part, 1}, compression, pixels);
}

}  // namespace beamspread
