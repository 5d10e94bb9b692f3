int sf_bytes(void);
int sf_bytes(void) { return (int)sizeof(NAME_t); }
void sf_init(NAME_t *self);
void sf_init(NAME_t *self) { NAME_init(self); }
void sf_plan(const NAME_t *self, double *x, double *u, double *z);
void sf_plan(const NAME_t *self, double *x, double *u, double *z)
{
    int k, i;
    for (k = 0; k <= N; k++) {
        for (i = 0; i < NX; i++) {
            x[k * NX + i] = self->x[k][i];
        }
        for (i = 0; k < N && i < NU; i++) {
            u[k * NU + i] = self->u[k][i];
        }
    }
    for (k = 0; k < ALL; k++) {
        z[k] = self->z[k];
    }
}
/* All members of in and of param in order, all doubles of out and its counts. */
void sf_cycle(NAME_t *self, const double *param, int iterations, const double *in, double *out,
              int *counts);
void sf_cycle(NAME_t *self, const double *param, int iterations, const double *in, double *out,
              int *counts)
{
    NAME_param_t p;
    NAME_out_t o;
    memcpy(&p, param, SF_PARAM * sizeof(double));
    p.iterations = iterations;
    NAME_step(self, &p, (const NAME_in_t *)(const void *)in, &o);
    memcpy(out, &o, SF_OUT * sizeof(double));
    counts[0] = o.iterations;
    counts[1] = o.program_iterations;
    counts[2] = o.status;
}
