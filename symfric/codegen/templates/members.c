#include "@name.h"

enum { STATES = @states, PARAMS = @params, INPUTS = @inputs, OUTPUTS = @outputs };

void members(long count, @real *state, const @real *param, const @real *in, @real *out,
             unsigned int *status);

void members(long count, @real *state, const @real *param, const @real *in, @real *out,
             unsigned int *status)
{
    for (; count > 0; count--) {
        @step
        state += STATES;
        param += PARAMS;
        in += INPUTS;
        out += OUTPUTS;
        status += 1;
    }
}
