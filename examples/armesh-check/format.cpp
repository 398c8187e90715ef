#include "format.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace check {
namespace {

// Length of the well-formed UTF-8 sequence at `at`, 0 if there is none.
std::size_t utf8_length(const std::string &text, std::size_t at) {
    const auto byte = [&](std::size_t k) -> unsigned {
        return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u;
    };
    const unsigned lead = byte(at);
    const std::size_t length = lead < 0x80 ? 1 : lead >= 0xC2 && lead < 0xE0 ? 2 : lead >= 0xE0 && lead < 0xF0 ? 3
                               : lead >= 0xF0 && lead < 0xF5                 ? 4
                                                                             : 0;
    for (std::size_t k = 1; k < length; ++k) {
        if ((byte(at + k) & 0xC0) != 0x80) {
            return 0;
        }
    }
    const unsigned second = byte(at + 1);
    const bool overlong = (lead == 0xE0 && second < 0xA0) || (lead == 0xF0 && second < 0x90);
    const bool outside = (lead == 0xED && second > 0x9F) || (lead == 0xF4 && second > 0x8F);
    return overlong || outside ? 0 : length;
}

} // namespace

std::string exact(double value, const char *missing) {
    if (!std::isfinite(value)) {
        return missing;
    }
    char text[40];
    for (int digits = 15; digits <= 17; ++digits) {
        std::snprintf(text, sizeof text, "%.*g", digits, value);
        if (std::strtod(text, nullptr) == value) {
            break;
        }
    }
    return text;
}

std::string json_string(const std::string &text) {
    std::string out = "\"";
    for (std::size_t i = 0; i < text.size();) {
        const unsigned char c = static_cast<unsigned char>(text[i]);
        if (c == '"' || c == '\\') {
            out += '\\';
            out += text[i++];
        } else if (c < 0x20 || c == 0x7F) {
            char escape[8];
            std::snprintf(escape, sizeof escape, "\\u%04x", c);
            out += escape;
            ++i;
        } else if (const std::size_t n = utf8_length(text, i)) {
            out.append(text, i, n);
            i += n;
        } else {
            out += "\xEF\xBF\xBD";
            ++i;
        }
    }
    return out + "\"";
}

std::string shown(double value, int digits) {
    if (std::isnan(value)) {
        return "-";
    }
    const double size = std::fabs(value);
    char text[64];
    if (value == 0 || (size >= 1e-3 && size < 1e7)) {
        const int before = value == 0 ? 1 : static_cast<int>(std::floor(std::log10(size))) + 1;
        std::snprintf(text, sizeof text, "%.*f", before >= digits ? 0 : digits - (before < 1 ? before : before), value);
    } else {
        std::snprintf(text, sizeof text, "%.*g", digits, value);
    }
    return text;
}

std::string shown(const std::array<double, 3> &at) {
    return "(" + shown(at[0]) + ", " + shown(at[1]) + ", " + shown(at[2]) + ")";
}

std::string shown(std::uint64_t count) {
    std::string text = std::to_string(count);
    for (std::size_t k = text.size(); k > 3; k -= 3) {
        text.insert(k - 3, ",");
    }
    return text;
}

} // namespace check
