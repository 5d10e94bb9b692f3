"""The loops of a controller in C from a quadratic program to a cycle: those of `gauss_newton`.

See `program_in_c`.
"""

CYCLE = r"""
static double merit(const NAME_t *m, const double (*x)[NX], const double (*u)[NU],
                    double *defects, double *prices)
{
    int k, i;
    double to[NX], value_of[NX + ROWS + 1], cost = 0.0;
    *defects = 0.0;
    *prices = 0.0;
    for (k = 0; k < N; k++) {
        for (i = 0; i < NX; i++) {
            to[i] = x[k][i];
        }
        for (i = 0; i < SUBSTEPS; i++) {
            advance(to, u[k], m->r[k], m->p, to);
        }
        value(x[k], u[k], x[k + 1], m->r[k], m->r[k + 1], m->p, &m->t[k], m->b, to, value_of);
        for (i = 0; i < NX; i++) {
            *defects += fabs(value_of[i]) / nominal_x[i];
        }
#if ROWS > 0
        for (i = 0; i < ROWS; i++) {
            *prices += price(i, value_of[NX + i]);
        }
#endif
        cost += value_of[NX + ROWS];
    }
#if END
    {
        double last[END_ROWS + 1];
        end_value(x[N], m->r[N], m->p, &m->t[N], m->b, last);
#if END_ROWS > 0
        for (i = 0; i < END_ROWS; i++) {
            *prices += price(N * ROWS + i, last[i]);
        }
#endif
        cost += last[END_ROWS];
    }
#endif
    return cost;
}

/* Take a step along the change; returns the weight of the defects. */
static double go_on(NAME_t *m, double nu)
{
    int k, i, tries;
    double defects, prices, cost, slope, fall, before, alpha = 1.0;
    cost = merit(m, (const double (*)[NX])m->x, (const double (*)[NU])m->u, &defects, &prices);
    slope = m->go.slope;
#if ALL > 0
    {
        double after = 0.0;
        for (k = 0; k < ALL; k++) {
            after += price(k, m->v[k] + m->go.D[k]);
        }
        slope += after - prices;
    }
#endif
    if (defects > 0.0) {
        const double bend = m->go.curvature > 0.0 ? m->go.curvature : 0.0;
        const double least = (slope + 0.5 * bend) / (0.5 * defects);
        nu = least > nu ? least : nu;
    }
    fall = slope - nu * defects;
    before = cost + prices + nu * defects;
    for (tries = 0; tries <= HALVINGS; tries++) {
        for (k = 0; k <= N; k++) {
            for (i = 0; i < NX; i++) {
                m->aim.x[k][i] = m->x[k][i] + alpha * m->go.x[k][i];
            }
            for (i = 0; k < N && i < NU; i++) {
                m->aim.u[k][i] = m->u[k][i] + alpha * m->go.u[k][i];
            }
        }
        if (tries == HALVINGS) {
            break;
        }
        cost = merit(m, (const double (*)[NX])m->aim.x, (const double (*)[NU])m->aim.u, &defects,
                     &prices);
        cost = cost + prices + nu * defects;
        if (cost <= before + ARMIJO * alpha * fall + ROUNDING * fabs(before)) {
            break;
        }
        alpha *= 0.5;
    }
    for (k = 0; k <= N; k++) {
        for (i = 0; i < NX; i++) {
            m->x[k][i] = m->aim.x[k][i];
        }
        for (i = 0; k < N && i < NU; i++) {
            m->u[k][i] = m->aim.u[k][i];
        }
    }
#if ALL > 0
    for (k = 0; k < ALL; k++) {
        m->z[k] += alpha * (m->zn[k] - m->z[k]);
    }
#endif
    return nu;
}

static void shift(NAME_t *m)
{
    int k, i;
    for (k = 0; k < N; k++) {
        for (i = 0; i < NX; i++) {
            m->x[k][i] = m->x[k + 1][i];
        }
    }
    for (k = 0; k < N - 1; k++) {
        for (i = 0; i < NU; i++) {
            m->u[k][i] = m->u[k + 1][i];
        }
#if ROWS > 0
        for (i = 0; i < ROWS; i++) {
            m->z[k * ROWS + i] = m->z[(k + 1) * ROWS + i];
        }
#endif
    }
}

static void improve(NAME_t *m, const NAME_param_t *param, NAME_out_t *out)
{
    double nu = 0.0;
    out->iterations = 0;
    out->program_iterations = 0;
    for (;;) {
        linearise(m);
        out->residual = residual_of(m, &out->violation);
        if (!isfinite(out->residual)) {
            out->status = NAME_FAILED;
            break;
        }
        if (out->residual <= param->tolerance) {
            out->status = NAME_CONVERGED;
            break;
        }
        if (out->iterations >= param->iterations) {
            out->status = NAME_NOT_CONVERGED;
            break;
        }
        out->iterations++;
        if (out->iterations > PLAIN) {
            curve(m);
        }
        out->program_iterations += program(m);
        nu = go_on(m, nu);
    }
    out->converged = out->status == NAME_CONVERGED;
}

/* A plan that stays where the model starts. */
static void begin(NAME_t *m)
{
    int k, i;
    for (k = 0; k <= N; k++) {
        for (i = 0; i < NX; i++) {
            m->x[k][i] = start_x[i];
        }
        for (i = 0; k < N && i < NU; i++) {
            m->u[k][i] = start_u[i];
        }
    }
#if ALL > 0
    for (k = 0; k < ALL; k++) {
        m->z[k] = 0.0;
    }
#endif
}

void NAME_init(NAME_t *self)
{
    self->warm = 0;
    begin(self);
}

void NAME_step(NAME_t *self, const NAME_param_t *param, const NAME_in_t *in, NAME_out_t *out)
{
    int k, i;
    const int sound = take(self, param, in);
    if (self->warm) {
        shift(self);
    }
    if (!sound) {
        show(self, out);
        out->residual = HUGE_VAL;
        out->violation = 0.0;
        out->iterations = 0;
        out->program_iterations = 0;
        out->status = NAME_BAD_INPUT;
        out->converged = 0;
        return;
    }
    measure(self, in);
    for (k = 1; k <= N && !self->warm; k++) {
        for (i = 0; i < NX; i++) {
            self->x[k][i] = self->x[0][i];
        }
    }
    show(self, out);
    improve(self, param, out);
    self->warm = out->status != NAME_FAILED;
    if (self->warm) {
        show(self, out);
    } else {
        begin(self);
    }
}
"""
