// armesh.h and armesh.hpp alone must compile as C++17.
#include <armesh.hpp>

int main() { return 0; }
