@source
#include "__fc_builtin.h"

/* One step from arbitrary bits of states, parameters and inputs. */
int main(void)
{
    @real state[@states + 1], param[@params + 1], in[@inputs + 1], out[@outputs + 1];
    unsigned int bits = 0u, *status = &bits;
    Frama_C_make_unknown((char *)state, sizeof state);
    Frama_C_make_unknown((char *)param, sizeof param);
    Frama_C_make_unknown((char *)in, sizeof in);
    @limits
    @step
    @shown
    return (int)*status;
}
