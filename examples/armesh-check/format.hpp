// Numbers and text for people and for files.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace check {

// The shortest decimal text that reads back as exactly `value`; `missing` if it is NaN or infinite.
std::string exact(double value, const char *missing);

// A JSON string with its quotes; bytes that are not UTF-8 become U+FFFD.
std::string json_string(const std::string &text);

// About `digits` significant digits for a reader, without an exponent for ordinary sizes; "-" for NaN.
std::string shown(double value, int digits = 4);

// "(x, y, z)"
std::string shown(const std::array<double, 3> &at);

// 12345 -> "12,345"
std::string shown(std::uint64_t count);

} // namespace check
