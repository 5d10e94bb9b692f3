#include "@name.h"

#include <stdio.h>
#include <stdlib.h>

/* Makes steps with numbers from standard input; if `own` is not 0, the parameters of each step
   precede its inputs. Returns 0 if the numbers end too early. */
static int @{name}_run(long steps, int own)
{
    enum { STATES = @states, PARAMS = @params, INPUTS = @inputs, OUTPUTS = @outputs };
    @real state[STATES + 1] = {0}, other[STATES + 1], given[PARAMS + 1], in[INPUTS + 1];
    @real out[OUTPUTS + 1] = {0}, said;
    const @real *param = given;
    @start
    (void)other;
    for (; steps > 0; steps--) {
        unsigned int bits = 0u, *status = &bits;
        if (own && fread(given, sizeof(@real), PARAMS, stdin) != PARAMS) { return 0; }
        if (fread(in, sizeof(@real), INPUTS, stdin) != INPUTS) { return 0; }
        @step
        fwrite(state, sizeof(@real), STATES, stdout);
        fwrite(out, sizeof(@real), OUTPUTS, stdout);
        @resets
        said = (@real)*status;
        if (@guards) { fwrite(&said, sizeof said, 1, stdout); }
    }
    (void)param;
    return 1;
}

#ifndef NO_MAIN
int main(int argc, char **argv)
{
    return @{name}_run(argc > 1 ? strtol(argv[1], NULL, 10) : 0, argc > 2) ? 0 : 1;
}
#endif
