#include "@name.h"

#include <stdio.h>
#include <stdlib.h>

typedef @real real;
enum { STATES = @states, PARAMS = @params, INPUTS = @inputs, OUTPUTS = @outputs };
static real state[STATES + 1], given[PARAMS + 1], in[INPUTS + 1], out[OUTPUTS + 1];
static real other[STATES + 1];

static int taken(real *to, size_t n) { return fread(to, sizeof(real), n, stdin) == n; }
static void shown(const real *from, size_t n) { fwrite(from, sizeof(real), n, stdout); }

/* Makes as many steps as the first argument says; with a second one parameters precede inputs. */
int main(int argc, char **argv)
{
    long steps = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    const real *param = given;
    @start
    for (; steps > 0; steps--) {
        unsigned int bits = 0u, *status = &bits;
        real said;
        if ((argc > 2 && !taken(given, PARAMS)) || !taken(in, INPUTS)) { return 1; }
        @step
        shown(state, STATES);
        shown(out, OUTPUTS);
        @resets
        said = (real)*status;
        if (@guards) { shown(&said, 1); }
    }
    return 0;
}
