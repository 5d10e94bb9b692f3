/* Unknowns that satisfy the algebraic equations at the start and after a jump of inputs or
   parameters. See symfric.integrator.equations.initial and .following. */

#if EQUATIONS
/* Return the change of the residual when the last digits of all numbers change. */
static double rounding(const double *y, const double *d)
{
    double g[EQUATIONS], moved[EQUATIONS], J[EQUATIONS * EQUATIONS], yy[N], dd[ND + 1], most = 0.0;
    unsigned int bits = 2463534242u;
    int i, k;
    model_equations(y, d, g, J);
    for (k = 0; k < 4; ++k) {
        for (i = 0; i < N + ND; ++i) {
            const double value = i < N ? y[i] : d[i - N];
            bits ^= bits << 13;
            bits ^= bits >> 17;
            bits ^= bits << 5;
            if (i < N) {
                yy[i] = value * (1.0 + ((bits & 1u) ? 1e-15 : -1e-15));
            } else {
                dd[i - N] = value * (1.0 + ((bits & 1u) ? 1e-15 : -1e-15));
            }
        }
        model_equations(yy, dd, moved, J);
        for (i = 0; i < EQUATIONS; ++i) moved[i] -= g[i];
        if (norm_of(moved, EQUATIONS) > most) most = norm_of(moved, EQUATIONS);
    }
    return most;
}

/* Compute a step of Newton's method in y and the residual; return 0 if the matrix is singular. */
static int newton_step(const double *y, const double *d, double *change, double *residual)
{
    double g[EQUATIONS], J[EQUATIONS * EQUATIONS];
    int i, j;
    model_equations(y, d, g, J);
    *residual = norm_of(g, EQUATIONS);
    if (!isfinite(*residual) || !solved(EQUATIONS, J, g)) return 0;
    for (i = 0; i < N; ++i) {
        change[i] = 0.0;
        for (j = 0; j < EQUATIONS; ++j) change[i] += model_free[i + j * N] * g[j];
    }
    return 1;
}

/* Solve by damped Newton from the guess in y; return 0 and leave y unchanged on failure. */
static int searched(double *y, const double *d)
{
    double now[N], change[N], trial[N], g[EQUATIONS], J[EQUATIONS * EQUATIONS], residual;
    double last = HUGE_VAL;
    int i, k, part;
    memcpy(now, y, sizeof now);
    for (k = 0; k < 50; ++k) {
        double size = 0.0, share = 1.0;
        if (!newton_step(now, d, change, &residual)) return 0;
        for (i = 0; i < N; ++i) {
            if (fabs(change[i]) > size * (fabs(now[i]) + 1e-14)) {
                size = fabs(change[i]) / (fabs(now[i]) + 1e-14);
            }
        }
        if (size < 1e-4) {
            for (i = 0; i < N; ++i) now[i] -= change[i];
            if (size < 1e-10 || size > last / 2.0) {
                memcpy(y, now, sizeof now);
                return 1;
            }
        } else if (isfinite(last) && residual <= rounding(now, d)) {
            memcpy(y, now, sizeof now);
            return 1;
        } else {
            for (part = 0; part < 12; ++part, share *= 0.5) {
                for (i = 0; i < N; ++i) trial[i] = now[i] - share * change[i];
                model_equations(trial, d, g, J);
                if (norm_of(g, EQUATIONS) < residual) break;
            }
            if (part == 12) return 0;
            memcpy(now, trial, sizeof now);
        }
        last = size;
    }
    return 0;
}

/* Return 1 if the solution is not physical: friction jams, or a bearing pulls. */
static int jams(const double *y, const double *d)
{
    double after[N], look[3];
    model_round(y, d, after, look);
    return !(look[2] >= 0.0);
}
#endif

#if CONSTRAINTS
/* Project positions and velocities onto the constraints; return 0 on failure. */
static int assembled(double *y, const double *d)
{
    double defect[2 * CONSTRAINTS], after[N];
    int k;
    for (k = 0; k < 50; ++k) {
        const double scale = largest(y, NX) > 1.0 ? largest(y, NX) : 1.0;
        model_defect(y, d, defect);
        if (largest(defect, 2 * CONSTRAINTS) < 1e-12 * scale) return 1;
        model_project(y, d, after);
        memcpy(y, after, sizeof after);
    }
    return 0;
}
#endif

/* Make all unknowns in y consistent, with `moved` also the states of a mechanism. Return an error
   message, empty on success. */
static const char *consistent(double *y, const double *d, int moved)
{
#if CONSTRAINTS
    if (moved && !assembled(y, d)) {
        return "the loops of the mechanism cannot be closed from these positions and velocities; "
               "give others";
    }
#endif
#if EQUATIONS
    if (symfric_follow(y, d) && !searched(y, d)) {
        return "the algebraic equations have no solution near their last one; give better start "
               "values, or change inputs and parameters less at once";
    }
#endif
#if BASIS
    if (moved) {
        double slope[CONSTRAINTS * COORDINATES];
        model_slope(y, d, slope);
        null_space(CONSTRAINTS, COORDINATES, slope, y + BASIS_AT);
    }
#endif
#if EQUATIONS
    if (jams(y, d)) {
        return "friction jams: reactions grow with the friction that they cause, or a bearing "
               "would pull; less friction, a longer bearing or a brake that does not lock itself "
               "would let it move";
    }
#endif
    (void)y;
    (void)d;
    (void)moved;
    return "";
}
