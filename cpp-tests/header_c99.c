/* armesh.h alone must compile as C99 and nothing more. */
#include <armesh.h>

#define LAYOUT_JOIN(a, b) a##b
#define LAYOUT_NAME(line) LAYOUT_JOIN(layout_, line)
#define LAYOUT(condition) typedef char LAYOUT_NAME(__LINE__)[(condition) ? 1 : -1]
#include "header_layout.inc"

int main(void) {
    return 0;
}
