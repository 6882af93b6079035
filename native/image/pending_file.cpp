#include "image/pending_file.h"

#include <atomic>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/platform.h"

namespace beamspread {

namespace fs = std::filesystem;

namespace {

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

}  // namespace

PendingFile::PendingFile(std::string target) : m_target(std::move(target)), m_path(temporary_name(m_target))
{
    std::error_code ignored;
    const fs::path folder = fs::path(m_target).parent_path();
    if (!folder.empty() && !fs::is_directory(folder, ignored))
        fail(m_target, "there is no folder '" + folder.string() + "'");
    const fs::file_status status = fs::status(m_target, ignored);
    if (fs::is_directory(status))
        fail(m_target, "it is a folder");
    // The permission bits, not access(2): root may write everywhere, yet a file was made read-only for a reason.
    constexpr fs::perms any_write = fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;
    if (fs::exists(status) && ((status.permissions() & any_write) == fs::perms::none || !may_write(m_target)))
        fail(m_target, "the file is read-only");
}

PendingFile::~PendingFile()
{
    std::error_code ignored;
    fs::remove(m_path, ignored);
}

void PendingFile::commit()
{
    std::error_code error;
    const fs::file_status status = fs::status(m_target, error);
    if (fs::exists(status))
        fs::permissions(m_path, status.permissions(), error);
    fs::rename(m_path, m_target, error);
    if (error)
        fail(m_target, error.message());
}

}  // namespace beamspread
