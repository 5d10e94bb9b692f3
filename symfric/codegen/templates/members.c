#include "@name.h"

void members(long count, @real *state, const @real *param, const @real *in, @real *out,
             unsigned int *status);

void members(long count, @real *state, const @real *param, const @real *in, @real *out,
             unsigned int *status)
{
    for (long i = 0; i < count; i++) {
        @call;
    }
}
