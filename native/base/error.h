// Typed errors of the engine; python/module.cpp translates them for the host.
#pragma once

#include <stdexcept>
#include <string>

namespace beamspread {

// An argument outside its range. The message names argument, value and range.
class InvalidArgument : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

// A file that cannot be read or written. The message names the path.
class IoError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// A job that needs more memory than the caller allows. The message gives the amount.
class MemoryLimit : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// Outcome of a job whose progress callback asked to stop; not a fault.
class Cancelled : public std::runtime_error {
public:
    Cancelled() : std::runtime_error("cancelled") {}
};

// Throws InvalidArgument: "argument 'albedo' is 1.5; allowed: 0 <= albedo < 1".
[[noreturn]] void reject(const std::string& argument, const std::string& value, const std::string& allowed);
[[noreturn]] void reject(const std::string& argument, double value, const std::string& allowed);

}  // namespace beamspread
