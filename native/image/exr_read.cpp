#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <system_error>

#include "base/error.h"
#include "base/threads.h"
#include "image/exr.h"
#include "image/exr_header.h"

namespace beamspread {

namespace {

// No deflate stream grows by more than this when it is unpacked, nor does OpenEXR's run-length code.
constexpr long long max_inflation = 1032;
// For the last, partly filled blocks of a tiny file.
constexpr long long inflation_slack = 1 << 20;
// Tiles are unpacked into a cache of one row of tiles.
constexpr unsigned max_tile_side = 1 << 14;
constexpr bool reconstruct = false;  // a truncated file is refused, not guessed at
// Of a file, packed: they take a thread several times as long as reading some hundred headers once more.
constexpr std::size_t bytes_per_reader = std::size_t{1} << 20;

[[noreturn]] void fail(const std::string& reason)
{
    throw IoError(reason);
}

bool inflation_is_bounded(Imf::Compression compression)
{
    return compression == Imf::NO_COMPRESSION || compression == Imf::RLE_COMPRESSION ||
           compression == Imf::ZIPS_COMPRESSION || compression == Imf::ZIP_COMPRESSION;
}

// Refuses, before anything of its size is allocated, a part that cannot be read or that its file cannot hold. Returns
// how many numbers it holds.
long long check_header(const Imf::Header& header, long long file_bytes)
{
    if (header.hasType() && !Imf::isImage(header.type()))
        fail("it holds deep data, not an image");
    const Imath::Box2i& window = header.dataWindow();
    const long long width = 1LL + window.max.x - window.min.x;
    const long long height = 1LL + window.max.y - window.min.y;
    if (width < 1 || height < 1 || width > max_exr_side || height > max_exr_side)
        fail("its size is " + std::to_string(width) + " x " + std::to_string(height));

    long long pixel_bytes = 0;
    long long channels = 0;
    for (auto entry = header.channels().begin(); entry != header.channels().end(); ++entry) {
        if (entry.channel().xSampling != 1 || entry.channel().ySampling != 1)
            fail("channel '" + detail::as_utf8(entry.name()) + "' is subsampled");
        pixel_bytes += entry.channel().type == Imf::HALF ? 2 : 4;
        ++channels;
    }
    if (channels == 0)
        fail("it has no channels");
    if (width * height > max_exr_values / channels)
        fail("it holds more than 2^30 numbers");
    if (inflation_is_bounded(header.compression()) &&
        width * height * pixel_bytes > file_bytes * max_inflation + inflation_slack)
        fail("it claims more pixels than a file of its length can hold");
    if (header.hasTileDescription() &&
        (header.tileDescription().xSize > max_tile_side || header.tileDescription().ySize > max_tile_side))
        fail("its tiles are larger than " + std::to_string(max_tile_side));
    return width * height * channels;
}

// Of a part that passed check_header.
ExrPart read_part(Imf::MultiPartInputFile& file, int index)
{
    const Imf::Header& header = file.header(index);
    const Imath::Box2i& window = header.dataWindow();

    ExrPart part;
    part.name = header.hasName() ? detail::as_utf8(header.name()) : "";
    part.width = window.max.x - window.min.x + 1;
    part.height = window.max.y - window.min.y + 1;
    part.channels = detail::get_channels(header);
    part.attributes = detail::get_attributes(header);

    const std::size_t pixel_bytes = part.channels.size() * sizeof(float);
    const std::size_t row_bytes = pixel_bytes * static_cast<std::size_t>(part.width);
    part.pixels.resize(part.channels.size() * static_cast<std::size_t>(part.width) *
                       static_cast<std::size_t>(part.height));
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < part.channels.size(); ++c)
        buffer.insert(part.channels[c],
                      Imf::Slice::Make(Imf::FLOAT, part.pixels.data() + c, window, pixel_bytes, row_bytes));
    Imf::InputPart input(file, index);
    input.setFrameBuffer(buffer);
    input.readPixels(window.min.y, window.max.y);
    std::transform(part.channels.begin(), part.channels.end(), part.channels.begin(), detail::as_utf8);
    return part;
}

// The bytes of a file for several readers at a time: what one file holds, though another may take its place meanwhile.
class MemoryStream final : public Imf::IStream {
public:
    MemoryStream(const std::string& name, const std::vector<char>& bytes) : IStream(name.c_str()), m_bytes(bytes) {}

    bool read(char* to, int count) override
    {
        if (count < 0 || static_cast<std::uint64_t>(count) > m_bytes.size() - m_position)
            fail("it ends early");
        std::copy_n(m_bytes.begin() + static_cast<std::ptrdiff_t>(m_position), count, to);
        m_position += static_cast<std::uint64_t>(count);
        return m_position < m_bytes.size();
    }
    std::uint64_t tellg() override { return m_position; }
    void seekg(std::uint64_t position) override { m_position = std::min<std::uint64_t>(position, m_bytes.size()); }

private:
    const std::vector<char>& m_bytes;
    std::uint64_t m_position = 0;
};

std::vector<char> bytes_of(const std::string& path)
{
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (error)
        fail(error.message());
    std::vector<char> bytes(size);
    std::ifstream stream(path, std::ios::binary);
    if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        throw std::system_error(errno, std::generic_category());
    return bytes;
}

// Checks all headers before anything of the size that they claim is allocated.
void check_headers(const Imf::MultiPartInputFile& file, long long file_bytes)
{
    long long values = 0;
    for (int i = 0; i < file.parts(); ++i)
        values += check_header(file.header(i), file_bytes);
    if (values > max_exr_values)
        fail("it holds more than 2^30 numbers");
}

}  // namespace

std::vector<ExrPart> read_exr_parts(const std::string& path)
{
    try {
        const std::vector<char> bytes = bytes_of(path);
        std::vector<ExrPart> parts;
        std::once_flag counted;
        std::atomic<int> next = 0;
        // OpenEXR reads one part at a time: every thread reads the headers for itself, and takes the next part until none
        // is left.
        parallel_for(std::min(thread_count(), 1 + bytes.size() / bytes_per_reader), [&](std::size_t) {
            MemoryStream stream(path, bytes);
            constexpr int own_threads = 0;  // OpenEXR's thread pool is global state of the host's process
            Imf::MultiPartInputFile file(stream, own_threads, reconstruct);
            check_headers(file, static_cast<long long>(bytes.size()));
            std::call_once(counted, [&] { parts.resize(static_cast<std::size_t>(file.parts())); });
            for (int i = next++; i < file.parts(); i = next++)
                parts[static_cast<std::size_t>(i)] = read_part(file, i);
        });
        return parts;
    } catch (const std::exception& error) {
        throw IoError("cannot read '" + path + "': " + detail::reason_of(error, path));
    }
}

}  // namespace beamspread
