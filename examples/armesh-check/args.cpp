#include "args.hpp"

#include <cmath>
#include <cstdlib>

namespace check {
namespace {

// A number that fills the whole text and lies in low..high.
double number(const std::string &option, const std::string &text, double low, double high) {
    char *end = nullptr;
    const double value = std::strtod(text.c_str(), &end); // the program never leaves the "C" locale
    if (text.empty() || *end != '\0' || !std::isfinite(value) || value < low || value > high) {
        char range[80];
        std::snprintf(range, sizeof range, "%g to %g", low, high);
        throw UsageError(option + " takes a number from " + range + ", not '" + text + "'");
    }
    return value;
}

unsigned count(const std::string &option, const std::string &text, double low, double high) {
    const double value = number(option, text, low, high);
    if (value != std::floor(value)) {
        throw UsageError(option + " takes a whole number, not '" + text + "'");
    }
    return static_cast<unsigned>(value);
}

void refuse_clashes(const Args &args) {
    const std::string *files[] = {&args.part, &args.json, &args.vertex_csv, &args.ply, &args.feature_ply};
    for (int i = 0; i < 5; ++i) {
        for (int k = i + 1; k < 5; ++k) {
            if (!files[i]->empty() && *files[i] == *files[k]) {
                throw UsageError("'" + *files[i] + "' is named twice: every input and output needs a file of its own");
            }
        }
    }
}

} // namespace

Args parse_args(int argc, const char *const *argv) {
    Args args;
    bool only_files = false; // after "--"
    for (int i = 1; i < argc; ++i) {
        std::string word = argv[i], value;
        if (only_files || word.empty() || word[0] != '-' || word == "-") {
            if (!args.part.empty()) {
                throw UsageError("one part at a time: got '" + args.part + "' and '" + word + "'");
            }
            if (word.empty()) {
                throw UsageError("the part's file name is empty");
            }
            args.part = word;
            continue;
        }
        if (word == "--") {
            only_files = true;
            continue;
        }
        if (word == "--help" || word == "-h") {
            args.help = true;
            continue;
        }
        if (word == "--version") {
            args.version = true;
            continue;
        }
        if (word == "--quiet" || word == "-q") {
            args.quiet = true;
            continue;
        }
        // the rest takes a value: --option VALUE or --option=VALUE
        const auto equals = word.find('=');
        const bool joined = equals != std::string::npos;
        if (joined) {
            value = word.substr(equals + 1);
            word.resize(equals);
        }
        const bool known = word == "--json" || word == "--vertex-csv" || word == "--ply" || word == "--threads" ||
                           word == "--rays" || word == "--cone" || word == "--limit" || word == "--profile" ||
                           word == "--warn" || word == "--min-width" || word == "--feature-ply";
        if (!known) {
            throw UsageError("unknown option '" + word + "' (--help lists them)");
        }
        if (!joined) {
            if (++i >= argc) {
                throw UsageError(word + " needs a value");
            }
            value = argv[i];
        }
        if (value.empty()) {
            throw UsageError(word + " needs a value");
        }
        if (word == "--json") {
            args.json = value;
        } else if (word == "--vertex-csv") {
            args.vertex_csv = value;
        } else if (word == "--ply") {
            args.ply = value;
        } else if (word == "--feature-ply") {
            args.feature_ply = value;
        } else if (word == "--warn") {
            args.warn = number(word, value, 1e-9, 1e9);
        } else if (word == "--min-width") {
            args.min_width = number(word, value, 0, 1e9);
        } else if (word == "--profile") {
            if (value != "print" && value != "paper") {
                throw UsageError("--profile is print or paper, not '" + value + "'");
            }
            args.paper = value == "paper";
        } else if (word == "--threads") {
            args.threads = count(word, value, 0, 1024);
        } else if (word == "--rays") {
            args.rays = count(word, value, 1, 4096);
        } else if (word == "--cone") {
            args.cone_degrees = number(word, value, 1, 179);
        } else {
            args.limit = number(word, value, 1e-9, 1e9);
        }
    }
    if (args.part.empty() && !args.help && !args.version) {
        throw UsageError("which part? usage: armesh-check PART [options] (--help explains them)");
    }
    refuse_clashes(args);
    return args;
}

const char *help_text() {
    return R"(armesh-check: is a part too slender to print?

usage: armesh-check PART [options]

PART is a triangle mesh: STL (binary or ASCII), OBJ, PLY or 3MF. For every vertex the program measures a length D1 (the
farthest distance along the surface) and a width D2 (the diameter of a sphere that fits inside there); the slenderness
of the part is the largest D1 over the largest D2. It then finds the part's features (walls, pins, struts, ribs, tubes,
handles and the bodies they stand on) and lists those that are too slender or too thin, worst first.

  --profile NAME     print: for parts that are to be printed, on any triangulation (default);
                     paper: the method of Ge & Flynn (2022) as printed, on the mesh as it is
  --json FILE        write everything below, and more, as JSON (see README.md beside this program's source)
  --vertex-csv FILE  write x,y,z,d1,d2,ratio, one row per vertex; a value that could not be measured is empty
  --ply FILE         write a mesh coloured by D1/D2 that MeshLab and ParaView show, with d1, d2 and ratio as fields
  --feature-ply FILE write a mesh whose faces are coloured by feature
  --limit R          the slenderness that is too much; a part or feature exactly at R is too slender (default 8)
  --warn R           the slenderness of a feature from which on it is listed (default 5)
  --min-width W      a feature that is this thin somewhere, or thinner, is too thin (default 0: not judged)
  --rays N           rays per face for D2 (default 20; paper profile only)
  --cone DEGREES     full angle of the cone of rays (default 120; paper profile only)
  --threads N        worker threads, 0 = one per core (default 0)
  --quiet            print nothing but errors
  --help, --version

Lengths are in the unit of the file. Ctrl-C stops the program without leaving half a file.
Exit status: 0 nothing too slender or too thin, 1 something is, 2 wrong usage or bad input, 130 stopped by Ctrl-C.
)";
}

} // namespace check
