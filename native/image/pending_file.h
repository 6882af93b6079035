// A file that takes its name only when it is whole.
#pragma once

#include <string>

namespace beamspread {

// Holds the name of a temporary file beside `target`; `commit` renames it over the target, and without a commit it is
// removed. A target that exists is never left half written.
class PendingFile {
public:
    // Throws IoError, naming the target, where its folder is missing, or it is a folder or a read-only file (renaming
    // would replace that without a word).
    explicit PendingFile(std::string target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    const std::string& path() const { return m_path; }

    // Throws IoError, naming the target.
    void commit();

private:
    std::string m_target;
    std::string m_path;
};

}  // namespace beamspread
