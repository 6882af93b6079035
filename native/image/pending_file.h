// A file that takes its name only when it is whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace beamspread {

// Writes a temporary file beside `target`. `commit` renames it over the target; without a commit it is removed. An
// existing target is never left half written: the first failure of any call is remembered, and `commit` throws it.
class PendingFile {
public:
    // Throws IoError, naming the target, if its folder is missing, or if it is a folder or a read-only file (renaming
    // would replace that silently).
    explicit PendingFile(std::string target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    const std::string& path() const { return m_path; }

    void write(const char* data, std::size_t count);
    void seek(std::uint64_t position);
    std::uint64_t position() const { return m_position; }

    // Brings every byte to the disk and closes the file.
    void close();

    // Throws IoError, naming the target. Closes the file first where that has not been done.
    void commit();

private:
    [[noreturn]] void fail_with(int error);

    std::string m_target;
    std::string m_path;
    std::unique_ptr<char[]> m_buffer;
    std::FILE* m_file = nullptr;
    std::uint64_t m_position = 0;
    int m_error = 0;  // errno of the first failure; 0 while there is none
};

}  // namespace beamspread
