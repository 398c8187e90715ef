// The command line of armesh-check.
#pragma once

#include <stdexcept>
#include <string>

namespace check {

// Wrong usage; what() is one line for the user.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct Args {
    std::string part;
    std::string json;        // empty: not asked for
    std::string vertex_csv;  // empty: not asked for
    std::string ply;         // empty: not asked for
    unsigned threads = 0;    // 0: all cores
    unsigned rays = 0;       // 0: the library's default
    double cone_degrees = 0; // full angle, 0: the library's default
    std::string feature_ply; // empty: not asked for
    double limit = 8.0;      // a ratio at or over it is too slender
    double warn = 5.0;       // a feature's ratio at or over it deserves a look
    double min_width = 0.0;  // a feature whose width is at or under it is too thin; 0: not judged
    bool paper = false;      // the paper's profile, else the print profile
    bool quiet = false;
    bool help = false;
    bool version = false;
};

// Reads the command line. Throws UsageError.
Args parse_args(int argc, const char *const *argv);

// The text of --help.
const char *help_text();

} // namespace check
