/* armesh.h alone must compile as C99 and nothing more. */
#include <armesh.h>

int main(void) {
    return 0;
}
