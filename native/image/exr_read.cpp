#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/openexr.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>

#include "base/error.h"
#include "base/threads.h"
#include "image/exr.h"
#include "image/exr_header.h"

namespace beamspread {

namespace {

// Unpacked bytes that one packed byte of a deflate stream can hold at most.
constexpr long long max_deflation = 1032;
// Bytes for the last, partly filled blocks of a tiny file.
constexpr long long inflation_slack = 1 << 20;
// Bytes of a file beside its numbers: headers, tables of lines, and blocks that did not pack.
constexpr std::uintmax_t max_overhead = std::uintmax_t{1} << 28;
// Texels on the side of a tile. A cache of one row of tiles is allocated for unpacking.
constexpr unsigned max_tile_side = 1 << 14;
constexpr bool reconstruct = false;  // a truncated file is refused, not guessed at
constexpr int no_pool = 0;           // OpenEXR's thread pool is global state of the host's process
// Packed bytes for each reading thread. A thread reads all headers once more, which takes far less than unpacking.
constexpr std::size_t bytes_per_reader = std::size_t{1} << 20;

[[noreturn]] void fail(const std::string& reason)
{
    throw IoError(reason);
}

// Unpacked bytes, as the channels' types count them, that one byte of a file can hold at most.
long long max_inflation(Imf::Compression compression)
{
    switch (compression) {
        case Imf::NO_COMPRESSION:
            return 1;
        case Imf::PXR24_COMPRESSION:
            return 2 * max_deflation;  // floats lose a byte of four before they are deflated
        case Imf::DWAA_COMPRESSION:
        case Imf::DWAB_COMPRESSION:
            return 2 * 64 * max_deflation;  // floats become half, and runs of 128 bytes become two, which are deflated
        default:
            return max_deflation;  // RLE, PIZ, B44 and B44A pack less than deflate can
    }
}

// Refuses a part that cannot be read or that its file cannot hold, before its pixels are allocated. Returns the number
// of its values.
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
    if (width * height * pixel_bytes > file_bytes * max_inflation(header.compression()) + inflation_slack)
        fail("it claims more pixels than a file of its length can hold");
    if (header.hasTileDescription() &&
        (header.tileDescription().xSize > max_tile_side || header.tileDescription().ySize > max_tile_side))
        fail("its tiles are larger than " + std::to_string(max_tile_side));
    return width * height * channels;
}

// All of a part but its pixels.
ExrPart read_header(const Imf::Header& header)
{
    const Imath::Box2i& window = header.dataWindow();
    ExrPart part;
    part.name = header.hasName() ? detail::as_utf8(header.name()) : "";
    part.width = window.max.x - window.min.x + 1;
    part.height = window.max.y - window.min.y + 1;
    part.channels = detail::get_channels(header);
    part.half = detail::is_half(header);
    part.attributes = detail::get_attributes(header);
    return part;
}

// Needs a part that passed check_header.
ExrPart read_part(Imf::MultiPartInputFile& file, int index)
{
    if (!file.partComplete(index))
        fail("it is not complete");
    ExrPart part = read_header(file.header(index));
    const Imath::Box2i& window = file.header(index).dataWindow();
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

// Bytes of a file in memory. Several readers share them, even if another file takes its name meanwhile.
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
    if (size > static_cast<std::uintmax_t>(max_exr_values) * sizeof(float) + max_overhead)
        fail("it is larger than 2^30 numbers");
    std::vector<char> bytes(size);
    std::ifstream stream(path, std::ios::binary);
    if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        throw std::system_error(errno, std::generic_category());
    return bytes;
}

// Returns the reason why OpenEXR's C interface refuses the headers; empty if it accepts them. Unlike the C++ interface,
// it compares the sizes that attributes claim with the size of the file before it allocates them.
std::string fault_of_headers(Imf::IStream& stream, std::uint64_t file_bytes)
{
    struct State {
        Imf::IStream& stream;
        std::uint64_t bytes;
        std::string fault;
    } state{stream, file_bytes, {}};

    exr_context_initializer_t with = EXR_DEFAULT_CONTEXT_INITIALIZER;
    with.user_data = &state;
    with.size_fn = [](exr_const_context_t, void* user) {
        return static_cast<std::int64_t>(static_cast<State*>(user)->bytes);
    };
    with.read_fn = [](exr_const_context_t, void* user, void* to, std::uint64_t count, std::uint64_t from,
                      exr_stream_error_func_ptr_t) -> std::int64_t {
        auto& source = *static_cast<State*>(user);
        try {
            if (from >= source.bytes)
                return 0;
            const std::uint64_t available = std::min({count, source.bytes - from, std::uint64_t{1} << 30});
            source.stream.seekg(from);
            source.stream.read(static_cast<char*>(to), static_cast<int>(available));
            return static_cast<std::int64_t>(available);
        } catch (...) {
            return -1;  // no exception may pass through C
        }
    };
    with.error_handler_fn = [](exr_const_context_t context, exr_result_t, const char* message) {
        void* user = nullptr;
        if (exr_get_user_data(context, &user) == EXR_ERR_SUCCESS && user != nullptr)
            static_cast<State*>(user)->fault = message;
    };
    exr_context_t context = nullptr;
    const exr_result_t result = exr_start_read(&context, stream.fileName(), &with);
    exr_finish(&context);
    stream.seekg(0);
    if (result == EXR_ERR_SUCCESS)
        return {};
    return state.fault.empty() ? exr_get_default_error_message(result) : state.fault;
}

// Opens a file after checking all that its headers claim, so that nothing of a claimed size is allocated before.
std::unique_ptr<Imf::MultiPartInputFile> open_checked(Imf::IStream& stream, std::uint64_t file_bytes)
{
    if (const std::string fault = fault_of_headers(stream, file_bytes); !fault.empty())
        fail(fault);
    auto file = std::make_unique<Imf::MultiPartInputFile>(stream, no_pool, reconstruct);
    long long values = 0;
    for (int i = 0; i < file->parts(); ++i)
        values += check_header(file->header(i), static_cast<long long>(file_bytes));
    if (values > max_exr_values)
        fail("it holds more than 2^30 numbers");
    return file;
}

}  // namespace

std::vector<ExrPart> read_exr_parts(const std::string& path)
{
    try {
        const std::vector<char> bytes = bytes_of(path);
        std::vector<ExrPart> parts;
        std::once_flag counted;
        std::atomic<int> next = 0;
        // OpenEXR reads one part at a time: every thread reads the headers for itself, and takes the next part until
        // none is left.
        parallel_for(std::min(thread_count(), 1 + bytes.size() / bytes_per_reader), [&](std::size_t) {
            MemoryStream stream(path, bytes);
            const auto file = open_checked(stream, bytes.size());
            std::call_once(counted, [&] { parts.resize(static_cast<std::size_t>(file->parts())); });
            for (int i = next++; i < file->parts(); i = next++)
                parts[static_cast<std::size_t>(i)] = read_part(*file, i);
        });
        return parts;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw IoError("cannot read '" + path + "': " + detail::reason_of(error, path));
    }
}

std::vector<ExrPart> read_exr_headers(const std::string& path)
{
    try {
        std::error_code error;
        const auto size = std::filesystem::file_size(path, error);
        if (error)
            fail(error.message());
        Imf::StdIFStream stream(path.c_str());
        const auto file = open_checked(stream, size);
        std::vector<ExrPart> parts;
        for (int i = 0; i < file->parts(); ++i)
            parts.push_back(read_header(file->header(i)));
        return parts;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw IoError("cannot read '" + path + "': " + detail::reason_of(error, path));
    }
}

}  // namespace beamspread
