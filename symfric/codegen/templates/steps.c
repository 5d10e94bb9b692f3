#include "@name.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    long steps = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
@declarations

    for (; steps > 0; steps--) {
@body
    }
    return 0;
}
