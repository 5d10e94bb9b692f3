@banner
 */
#include "@{name}.h"

#include <math.h>
@booleans
/* Take everything that is given but the states; whether all of it is finite. */
static int take(@{name}_t *m, const @{name}_param_t *param, const @{name}_in_t *in)
{
    int k, sound = 1;
@constants    for (k = 0; k <= @count; k++) {
@each    }
    return sound;
}

static void measure(@{name}_t *m, const @{name}_in_t *in)
{
@measured}

static void show(const @{name}_t *m, @{name}_out_t *out)
{
    double u;
@controls}

@macros
@functions_of_libm
@tables
@kernels@loops
