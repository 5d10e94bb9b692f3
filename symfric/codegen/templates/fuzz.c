#include "@name.h"
#include "@bare.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef @real real;
enum { STATES = @states, PARAMS = @params, INPUTS = @inputs, OUTPUTS = @outputs };
enum { SIZE = @size }; /* index of the parameter that is the step size, or -1 */
enum { FORCE = @force, MOST = @most }; /* indices of the output F and of its limit F_max, or -1 */
enum { COMPARED = @compared }; /* 1 if bits are compared with the step without guards */
@columns

static uint64_t seed = 88172645463325252u;

static uint64_t bits(void) /* xorshift */
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return seed;
}

static double uniform(void) { return (double)(bits() >> 11) / 9007199254740992.0; }
static int one_in(unsigned n) { return bits() % n == 0u; }
static double sign(void) { return one_in(2) ? 1.0 : -1.0; }
static double tiny(void) { return @double ? 4.9406564584124654e-324 : 1.4012984643e-45; }

static real typed(double x) /* a cast that does not overflow */
{
    const double most = @double ? DBL_MAX : (double)FLT_MAX;
    return x != x ? (real)NAN : x > most ? (real)INFINITY : x < -most ? -(real)INFINITY : (real)x;
}

static double bad(double nominal)
{
    switch (bits() % 8u) {
    case 0: return NAN;
    case 1: return sign() * INFINITY;
    case 2: return sign() * (@double ? DBL_MAX : (double)FLT_MAX) * uniform();
    case 3: return sign() * nominal * pow(10.0, 40.0 * uniform());
    case 4: return -nominal * uniform();
    case 5: return sign() * tiny() * (double)(1u + bits() % 100u);
    case 6: return 0.0;
    default: return sign() * nominal * 1e12;
    }
}

static real valid(double low, double high, double nominal)
{
    double x;
    switch (bits() % 16u) {
    case 0: x = 0.0; break;
    case 1: x = one_in(2) ? low : high; break;
    case 2: x = sign() * tiny() * (double)(1u + bits() % 100u); break;
    case 3: x = low + (high - low) * uniform(); break;
    default: x = (low >= 0.0 ? 1.0 : sign()) * nominal * pow(10.0, 12.0 * uniform() - 9.0); break;
    }
    x = x < low ? low : x > high ? high : x;
    {
        const real y = typed(x); /* rounding may leave the range */
        return y < (real)low ? (real)low : y > (real)high ? (real)high : y;
    }
}

static real any_bits(void)
{
    const uint64_t word = bits();
    real found;
    memcpy(&found, &word, sizeof found);
    return found;
}

static real state[STATES + 1], param[PARAMS + 1], in[INPUTS + 1], out[OUTPUTS + 1];
static unsigned int bits_of_status, *const status = &bits_of_status;

static void guarded(void)
{
    *status = 0u;
    @step
}

static void bare(void)
{
    @step_bare
}

static int differs(const real *a, const real *b, int n) /* except for the sign of a zero */
{
    for (int i = 0; i < n; i++) {
        if (!(a[i] == b[i] || (a[i] != a[i] && b[i] != b[i]))) { return 1; }
    }
    return 0;
}

static int all_finite(const real *a, int n)
{
    for (int i = 0; i < n; i++) {
        if (!isfinite(a[i])) { return 0; }
    }
    return 1;
}

static unsigned int expected(void) /* the status that the numbers require */
{
    unsigned int found = 0u;
    for (int i = 0; i < INPUTS; i++) {
        if (IN_USED[i] == 0) { continue; }
        if (!isfinite(in[i])) { found |= 2u; }
        else if (in[i] < IN_LOW[i] || in[i] > IN_HIGH[i]) { found |= 1u; }
    }
    for (int i = 0; i < PARAMS; i++) {
        if (!(param[i] >= PARAM_LOW[i] && param[i] <= PARAM_HIGH[i])) { found |= 8u; }
    }
    for (int i = 0; i < STATES; i++) {
        if (!(state[i] >= -STATE_LIMIT[i] && state[i] <= STATE_LIMIT[i])) { found |= 4u; }
    }
    return found;
}

static int beyond_limit(void) /* the force exceeds its limit; a flagged limit is the default */
{
    double most;
    if (FORCE < 0 || MOST < 0) { return 0; }
    most = (double)param[MOST < 0 ? 0 : MOST];
    if ((*status & 8u) != 0u && !(most >= (double)PARAM_START[MOST < 0 ? 0 : MOST])) {
        most = (double)PARAM_START[MOST < 0 ? 0 : MOST];
    }
    return !(fabs((double)out[FORCE < 0 ? 0 : FORCE]) <= most);
}

int main(int argc, char **argv)
{
    const long steps = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    long good = 0, repaired = 0, altered = 0, unflagged = 0, unfinished = 0, last = 0, beyond = 0;
    int garbage = 0; /* 1 if states may follow from random bits */
    memcpy(state, STATE_START, sizeof(real) * STATES);
    for (long k = 0; k < steps; k++) {
        real before[STATES + 1], after[STATES + 1], shown[OUTPUTS + 1];
        unsigned int must;
        int own = 0; /* 1 if a parameter differs from its default */
        if (garbage != 0 && one_in(2)) { /* otherwise steps follow from random states */
            memcpy(state, STATE_START, sizeof(real) * STATES);
            garbage = 0;
        }
        @default
        for (int i = 0; i < INPUTS; i++) {
            in[i] = valid((double)IN_LOW[i], (double)IN_HIGH[i], (double)IN_NOMINAL[i]);
        }
        if (SIZE >= 0 && one_in(2)) {
            param[SIZE < 0 ? 0 : SIZE] = typed(pow(10.0, -9.0 + 12.0 * uniform()));
        }
        if (one_in(4)) {
            if (INPUTS > 0 && one_in(2)) {
                const int i = (int)(bits() % (INPUTS > 0 ? INPUTS : 1));
                in[i] = typed(bad((double)IN_NOMINAL[i]));
            }
            if (PARAMS > 0 && one_in(4)) {
                const int i = (int)(bits() % (PARAMS > 0 ? PARAMS : 1));
                param[i] = typed(bad(fabs((double)PARAM_START[i]) + 1e-3));
                own = 1;
            }
            if (STATES > 0 && one_in(4)) {
                const int i = (int)(bits() % (STATES > 0 ? STATES : 1));
                state[i] = typed(bad((double)STATE_LIMIT[i] * 1e-10));
            }
        }
        if (one_in(4)) { /* a memory error */
            for (int i = 0; i < STATES; i++) { state[i] = any_bits(); }
            for (int i = 0; i < INPUTS && one_in(2); i++) { in[i] = any_bits(); }
            for (int i = 0; i < PARAMS && one_in(16); i++) { param[i] = any_bits(); }
            garbage = own = 1;
            if (MOST >= 0 && one_in(2)) {
                param[MOST < 0 ? 0 : MOST] = typed(pow(10.0, 6.0 * uniform() - 3.0));
            }
        }
        must = expected();
        memcpy(before, state, sizeof before);
        guarded();
        if (!all_finite(out, OUTPUTS)) { unfinished++; }
        if (beyond_limit()) { beyond++; }
        if ((*status & 16u) != 0u && !own && garbage == 0) { last++; }
        if ((*status & 15u) != must) { unflagged++; }
        if (*status != 0u) { repaired++; continue; }
        good++;
        memcpy(after, state, sizeof after);
        memcpy(shown, out, sizeof shown);
        memcpy(state, before, sizeof before);
        bare();
        if (COMPARED && (differs(after, state, STATES) || differs(shown, out, OUTPUTS))) { altered++; }
        memcpy(state, after, sizeof after);
    }
    printf("%ld %ld %ld %ld ", good, repaired, altered, unflagged);
    printf("%ld %ld %ld\n", unfinished, last, beyond);
    return 0;
}
