static double larger(double a, double b) { return (b > a || b != b) ? b : a; }

static void linearise(NAME_t *m)
{
    int k, i;
    double to[NX], S[NS];
    for (k = 0; k < N; k++) {
        for (i = 0; i < NX; i++) {
            to[i] = m->x[k][i];
        }
        for (i = 0; i < NS; i++) {
            S[i] = identity[i];
        }
        for (i = 0; i < SUBSTEPS; i++) {
            tangent(to, S, m->u[k], m->r[k], m->p, to, S);
        }
        linear(m->x[k], m->u[k], m->x[k + 1], m->r[k], m->r[k + 1], m->p, &m->t[k], m->b, to, S,
               m->L[k]);
    }
#if END
    end_linear(m->x[N], m->r[N], m->p, &m->t[N], m->b, m->L_end);
#endif
}

#if ALL > 0
static void take_rows(NAME_t *m)
{
    int k, i, j = 0;
    for (k = 0; k < N; k++) {
        for (i = 0; i < ROWS; i++) {
            m->v[j++] = m->L[k][NX + i];
        }
    }
    for (i = 0; i < END_ROWS; i++) {
        m->v[j++] = m->L_end[i];
    }
}

static double price(int j, double v)
{
    const double s = -v > 0.0 ? -v : 0.0;
    return rho[ROW(j)] * s + 0.5 * (sigma[ROW(j)] * (s * s));
}
#endif

static void matrices(NAME_t *m)
{
    int k;
    double P[NP];
#if END
    end_matrix(m->L_end, m->w + N * ROWS, P);
#else
    for (k = 0; k < NP; k++) {
        P[k] = 0.0;
    }
#endif
    for (k = N - 1; k >= 0; k--) {
        matrix(P, m->L[k], m->w + k * ROWS, P, m->G[k]);
    }
}

/* The change that slopes e of the rows make. */
static void change(NAME_t *m, move_t *to)
{
    int k;
    double q[NX], step[STEP];
#if END
    end_vector(m->L_end, m->e + N * ROWS, q);
#else
    for (k = 0; k < NX; k++) {
        q[k] = 0.0;
    }
#endif
    for (k = N - 1; k >= 0; k--) {
        vector(q, m->L[k], m->G[k], m->e + k * ROWS, q, m->k[k]);
    }
    for (k = 0; k < NX; k++) {
        to->x[0][k] = 0.0;
    }
    to->slope = 0.0;
    to->curvature = 0.0;
    for (k = 0; k < N; k++) {
        int i;
        forward(to->x[k], m->L[k], m->G[k], m->k[k], to->x[k + 1], step);
        for (i = 0; i < NU; i++) {
            to->u[k][i] = step[i];
        }
#if ROWS > 0
        for (i = 0; i < ROWS; i++) {
            to->D[k * ROWS + i] = step[NU + i];
        }
#endif
        to->slope += step[NU + ROWS];
        to->curvature += step[NU + ROWS + 1];
    }
#if END
    {
        double last[END_ROWS + 2];
        end_forward(to->x[N], m->L_end, last);
#if END_ROWS > 0
        for (k = 0; k < END_ROWS; k++) {
            to->D[N * ROWS + k] = last[k];
        }
#endif
        to->slope += last[END_ROWS];
        to->curvature += last[END_ROWS + 1];
    }
#endif
}

/* Curvature of the equations, weighted with their multipliers, joins the Hessian where that stays
   positive over the horizon. */
static void curve(NAME_t *m)
{
    int k, i, sound = 1;
    for (k = 0; k < N; k++) {
        double to[SUBSTEPS + 1][NX], S[SUBSTEPS + 1][NS], lam[NX], *E = m->L[k] + (NL - NE);
        for (i = 0; i < NX; i++) {
            to[0][i] = m->x[k][i];
            lam[i] = m->lam[k][i];
        }
        for (i = 0; i < NS; i++) {
            S[0][i] = identity[i];
        }
        for (i = 0; i < SUBSTEPS; i++) {
            tangent(to[i], S[i], m->u[k], m->r[k], m->p, to[i + 1], S[i + 1]);
        }
        for (i = SUBSTEPS - 1; i >= 0; i--) {
            bend(lam, E, to[i], S[i], m->u[k], m->r[k], m->p, lam, E);
        }
    }
#if ALL > 0
    for (k = 0; k < ALL; k++) {
        m->w[k] = 0.0;
    }
#endif
    matrices(m);
    for (k = 0; k < N; k++) {
        for (i = PIVOTS; i < PIVOTS + NU; i++) {
            sound = sound && m->G[k][i] > 0.0;
        }
    }
    for (k = 0; k < N && !sound; k++) {
        for (i = NL - NE; i < NL; i++) {
            m->L[k][i] = 0.0;
        }
    }
}

/* The residual of the plan; the largest violation of a soft row; an estimate of the rounding
   errors of the residual from the terms that multipliers of the rows cancel. */
static double residual_of(NAME_t *m, double *violation, double *rounding)
{
    int k, i;
    double l[NX], S[NU + NX], found = 0.0;
#if ROWS > 0
    const double none[ROWS] = {0.0};
    double l_free[NX], S_free[NU + NX];
#endif
    *violation = 0.0;
    *rounding = 0.0;
#if END
    end_adjoint(m->L_end, m->z + N * ROWS, l);
#else
    for (k = 0; k < NX; k++) {
        l[k] = 0.0;
    }
#endif
    for (k = N - 1; k >= 0; k--) {
#if ROWS > 0
        adjoint(l, m->L[k], none, l_free, S_free);
#endif
        adjoint(l, m->L[k], m->z + k * ROWS, l, S);
        for (i = 0; i < NU; i++) {
            found = larger(found, fabs(S[i] * nominal_u[i]) / CURVATURE);
#if ROWS > 0
            S_free[i] -= S[i];
            *rounding = larger(*rounding, RESOLUTION * fabs(S_free[i] * nominal_u[i]) / CURVATURE);
#endif
        }
        for (i = 0; i < NX; i++) {
            m->lam[k][i] = S[NU + i];
            found = larger(found, fabs(m->L[k][i]) / nominal_x[i]);
        }
    }
#if ALL > 0
    take_rows(m);
    for (k = 0; k < ALL; k++) {
        const double v = m->v[k], below = -v > 0.0 ? -v : 0.0;
        const double kept = larger(below, fabs(m->z[k] * v) / larger(CURVATURE, m->z[k]));
        double miss = kept;
        if (soft[ROW(k)]) {
            const double owed = rho[ROW(k)] + sigma[ROW(k)] * below - m->z[k];
            const double paid = fabs(owed * v) / rho[ROW(k)];
            *violation = larger(*violation, below);
            miss = v < 0.0 && paid < kept ? paid : kept;
        }
        found = larger(found, miss);
    }
#endif
    return found;
}

#if ALL > 0
static void direction(NAME_t *m)
{
    int j;
    for (j = 0; j < ALL; j++) {
        const int i = ROW(j);
        double a = 0.0;
        if (soft[i]) {
            a = rho[i] + sigma[i] * m->s[j] - m->zn[j] - m->goal_s[j] / m->s[j];
        }
        m->a[j] = a;
        m->o[j] = m->goal_t[j] / m->zn[j] - m->v[j] - m->s[j] + m->f[j] * a;
        m->e[j] = -(m->zn[j] + m->w[j] * m->o[j]);
    }
    change(m, &m->aim);
    for (j = 0; j < ALL; j++) {
        const int i = ROW(j);
        m->dz[j] = m->w[j] * (m->o[j] - m->aim.D[j]);
        m->ds[j] = 0.0;
        m->dy[j] = 0.0;
        if (soft[i]) {
            m->ds[j] = m->f[j] * (m->dz[j] - m->a[j]);
            m->dy[j] = rho[i] + sigma[i] * m->s[j] + sigma[i] * m->ds[j] - (m->zn[j] + m->dz[j])
                       - m->y[j];
        }
        m->dt[j] = m->v[j] + m->aim.D[j] + m->s[j] + m->ds[j] - m->ts[j];
    }
}

static double within(double alpha, double a, double da)
{
    if (da < 0.0 && -a / da < alpha) {
        alpha = -a / da;
    }
    return alpha;
}

static double reach(const NAME_t *m, double back)
{
    int j;
    double alpha = 1.0 / back;
    for (j = 0; j < ALL; j++) {
        alpha = within(alpha, m->ts[j], m->dt[j]);
        alpha = within(alpha, m->zn[j], m->dz[j]);
        if (soft[ROW(j)]) {
            alpha = within(alpha, m->s[j], m->ds[j]);
            alpha = within(alpha, m->y[j], m->dy[j]);
        }
    }
    alpha *= back;
    return alpha < 1.0 ? alpha : 1.0;
}

static double gap(const NAME_t *m, double alpha)
{
    int j;
    double sum = 0.0;
    for (j = 0; j < ALL; j++) {
        double pair = (m->ts[j] + alpha * m->dt[j]) * (m->zn[j] + alpha * m->dz[j]);
        if (soft[ROW(j)]) {
            pair += (m->s[j] + alpha * m->ds[j]) * (m->y[j] + alpha * m->dy[j]);
        }
        sum += pair;
    }
    return sum;
}

static void start_inside(NAME_t *m, double worst)
{
    int j;
    const double product = CURVATURE * (worst > 1.0 ? worst : 1.0);
    const double away = worst > AWAY ? worst : AWAY;
    for (j = 0; j < ALL; j++) {
        const int i = ROW(j);
        const double first = m->v[j] + m->go.D[j];
        m->ts[j] = first > away ? first : away;
        m->zn[j] = product / m->ts[j];
        m->zn[j] = m->z[j] > m->zn[j] ? m->z[j] : m->zn[j];
        m->s[j] = 0.0;
        m->y[j] = 0.0;
        if (soft[i] && -m->v[j] * rho[i] > 2.0 * product) {
            m->s[j] = -m->v[j];
            m->y[j] = product / m->s[j];
            m->zn[j] = rho[i] + sigma[i] * m->s[j] - m->y[j];
            m->ts[j] = product / m->zn[j];
        } else if (soft[i]) {
            m->s[j] = product / rho[i];
            if (m->zn[j] > 0.5 * rho[i]) {
                m->zn[j] = 0.5 * rho[i];
            }
            m->y[j] = rho[i] + sigma[i] * m->s[j] - m->zn[j];
        }
        m->dt[j] = 0.0;
        m->dz[j] = 0.0;
        m->ds[j] = 0.0;
        m->dy[j] = 0.0;
    }
}

static void interior_step(NAME_t *m, double mu)
{
    int j, k, i;
    double alpha, ratio, centre;
    for (j = 0; j < ALL; j++) {
        m->f[j] = soft[ROW(j)] ? 1.0 / (sigma[ROW(j)] + m->y[j] / m->s[j]) : 0.0;
        m->w[j] = 1.0 / (m->ts[j] / m->zn[j] + m->f[j]);
        m->goal_t[j] = 0.0;
        m->goal_s[j] = 0.0;
    }
    matrices(m);
    direction(m);
    alpha = reach(m, 1.0);
    ratio = gap(m, alpha) / PAIRS / mu;
    centre = ratio * ratio * ratio * mu;
    for (j = 0; j < ALL; j++) {
        m->goal_t[j] = centre - m->dt[j] * m->dz[j];
        m->goal_s[j] = soft[ROW(j)] ? centre - m->ds[j] * m->dy[j] : 0.0;
    }
    direction(m);
    alpha = reach(m, BACK);
    for (j = 0; j < ALL; j++) {
        m->ts[j] = larger(m->ts[j] + alpha * m->dt[j], SMALLEST);
        m->zn[j] = larger(m->zn[j] + alpha * m->dz[j], SMALLEST);
        m->s[j] = larger(m->s[j] + alpha * m->ds[j], SMALLEST);
        m->y[j] = larger(m->y[j] + alpha * m->dy[j], SMALLEST);
        m->go.D[j] += alpha * (m->aim.D[j] - m->go.D[j]);
        m->dt[j] = 0.0;
        m->dz[j] = 0.0;
        m->ds[j] = 0.0;
        m->dy[j] = 0.0;
    }
    for (k = 0; k <= N; k++) {
        for (i = 0; i < NX; i++) {
            m->go.x[k][i] += alpha * (m->aim.x[k][i] - m->go.x[k][i]);
        }
        for (i = 0; k < N && i < NU; i++) {
            m->go.u[k][i] += alpha * (m->aim.u[k][i] - m->go.u[k][i]);
        }
    }
    m->go.slope = m->aim.slope;
    m->go.curvature = m->aim.curvature;
}
#endif

/* The quadratic program; returns the iterations of the interior point. */
static int program(NAME_t *m)
{
    int made = 0;
#if ALL > 0
    int j;
    double worst;
    for (j = 0; j < ALL; j++) {
        m->w[j] = 0.0;
        m->e[j] = 0.0;
        m->zn[j] = 0.0;
    }
#endif
    matrices(m);
    change(m, &m->go);
#if ALL > 0
    worst = -(m->v[0] + m->go.D[0]);
    for (j = 1; j < ALL; j++) {
        worst = larger(worst, -(m->v[j] + m->go.D[j]));
    }
    if (worst <= 0.0) {
        return 0;
    }
    start_inside(m, worst);
    while (made < MOST) {
        const double mu = gap(m, 0.0) / PAIRS;
        if (mu <= CLOSE * CURVATURE) {
            break;
        }
        made++;
        interior_step(m, mu);
    }
#endif
    return made;
}

/* The cost, defects and penalties of a plan; those of the linearised plan have known defects. */
static double merit(const NAME_t *m, const double (*x)[NX], const double (*u)[NU], int linearised,
                    double *defects, double *prices)
{
    int k, i;
    double to[NX], value_of[NX + ROWS + 1], cost = 0.0;
    *defects = 0.0;
    *prices = 0.0;
    for (k = 0; k < N; k++) {
        for (i = 0; i < NX; i++) {
            to[i] = linearised ? x[k + 1][i] + m->L[k][i] : x[k][i];
        }
        for (i = 0; i < SUBSTEPS && !linearised; i++) {
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
    cost = merit(m, (const double (*)[NX])m->x, (const double (*)[NU])m->u, 1, &defects, &prices);
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
        cost = merit(m, (const double (*)[NX])m->aim.x, (const double (*)[NU])m->aim.u, 0,
                     &defects, &prices);
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
    double nu = 0.0, rounding;
    out->iterations = 0;
    out->program_iterations = 0;
    for (;;) {
        linearise(m);
        out->residual = residual_of(m, &out->violation, &rounding) + rounding;
        if (!isfinite(out->residual)) {
            out->status = NAME_FAILED;
            break;
        }
        if (out->residual <= param->tolerance || out->residual <= 2.0 * rounding) {
            out->status = out->residual <= param->tolerance ? NAME_CONVERGED : NAME_ROUNDED;
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
