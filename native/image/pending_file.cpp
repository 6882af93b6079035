#include "image/pending_file.h"

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/platform.h"

namespace beamspread {

namespace fs = std::filesystem;

namespace {

// Bytes of the write buffer. OpenEXR writes line by line; a larger buffer means fewer calls of the system.
constexpr std::size_t buffer_bytes = std::size_t{1} << 20;

[[noreturn]] void fail(const std::string& target, const std::string& reason)
{
    throw IoError("cannot write '" + target + "': " + reason);
}

// Unique among the processes of this machine and the threads of this process.
std::string temporary_name(const std::string& target)
{
    static std::atomic<unsigned> counter{0};
    return target + "." + std::to_string(process_id()) + "-" + std::to_string(counter++) + ".tmp";
}

void check_target(const std::string& target)
{
    std::error_code ignored;
    const fs::path folder = fs::path(target).parent_path();
    if (!folder.empty() && !fs::is_directory(folder, ignored))
        fail(target, "there is no folder '" + folder.string() + "'");
    const fs::file_status status = fs::status(target, ignored);
    if (fs::is_directory(status))
        fail(target, "it is a folder");
    // The permission bits, not access(2): root may write everywhere, yet a file was made read-only for a reason.
    constexpr fs::perms any_write = fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;
    if (fs::exists(status) && ((status.permissions() & any_write) == fs::perms::none || !may_write(target)))
        fail(target, "the file is read-only");
}

}  // namespace

PendingFile::PendingFile(std::string target)
    : m_target(std::move(target)), m_path(temporary_name(m_target)), m_buffer(new char[buffer_bytes])
{
    check_target(m_target);
    m_file = std::fopen(m_path.c_str(), "wb");
    if (m_file == nullptr)
        fail_with(errno);
    std::setvbuf(m_file, m_buffer.get(), _IOFBF, buffer_bytes);
}

PendingFile::~PendingFile()
{
    if (m_file != nullptr)
        std::fclose(m_file);
    std::remove(m_path.c_str());  // unlike std::filesystem::remove, without an allocation that may fail
}

void PendingFile::write(const char* data, std::size_t count)
{
    if (m_error != 0)
        fail_with(m_error);
    if (std::fwrite(data, 1, count, m_file) != count)
        fail_with(errno);
    m_position += count;
}

void PendingFile::seek(std::uint64_t position)
{
    if (m_error != 0)
        fail_with(m_error);
    if (!seek_file(m_file, position))
        fail_with(errno);
    m_position = position;
}

void PendingFile::close()
{
    if (m_file == nullptr)
        return;
    if (m_error == 0 && !flush_to_disk(m_file))
        m_error = errno;
    if (std::fclose(std::exchange(m_file, nullptr)) != 0 && m_error == 0)
        m_error = errno;
    if (m_error != 0)
        fail_with(m_error);
}

void PendingFile::commit()
{
    close();
    if (m_error != 0)
        fail_with(m_error);
    std::error_code error;
    const fs::file_status status = fs::status(m_target, error);
    if (fs::exists(status))
        fs::permissions(m_path, status.permissions(), error);
    fs::rename(m_path, m_target, error);
    if (error)
        fail(m_target, error.message());
}

void PendingFile::fail_with(int error)
{
    m_error = error != 0 ? error : EIO;
    fail(m_target, std::generic_category().message(m_error));
}

}  // namespace beamspread
