// Typed errors of the engine; the host translates them at one boundary (python/module.cpp).
#pragma once

#include <stdexcept>
#include <string>

namespace beamspread {

// A caller's argument is outside what is allowed; the message names argument, value and range.
class InvalidArgument : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

// A file cannot be read or written; the message names the path.
class IoError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// More memory would be taken than the caller allows; the message says how much.
class MemoryLimit : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// The caller's progress callback asked to stop: an outcome of its own, not a fault.
class Cancelled : public std::runtime_error {
public:
    Cancelled() : std::runtime_error("cancelled") {}
};

// "argument 'albedo' is 1.5; allowed: 0 <= albedo < 1"
[[noreturn]] void reject(const std::string& argument, const std::string& value, const std::string& allowed);
[[noreturn]] void reject(const std::string& argument, double value, const std::string& allowed);

}  // namespace beamspread
