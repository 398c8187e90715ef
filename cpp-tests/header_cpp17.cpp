// armesh.h and armesh.hpp alone must compile as C++17.
#include <armesh.hpp>

#define LAYOUT(condition) static_assert(condition, #condition)
#include "header_layout.inc"

int main() { return 0; }
