#include "base/error.h"

#include <sstream>

namespace beamspread {

void reject(const std::string& argument, const std::string& value, const std::string& allowed)
{
    std::ostringstream text;
    text << "argument '" << argument << "' is " << value << "; allowed: " << allowed;
    throw InvalidArgument(text.str());
}

void reject(const std::string& argument, double value, const std::string& allowed)
{
    std::ostringstream text;
    text << value;
    reject(argument, text.str(), allowed);
}

}  // namespace beamspread
