/* Linear algebra of small dense matrices, stored by columns. */

#if CONSTRAINTS
static double largest(const double *a, int n)
{
    double found = 0.0;
    int i;
    for (i = 0; i < n; ++i) {
        if (fabs(a[i]) > found) found = fabs(a[i]);
    }
    return found;
}
#endif

#if EQUATIONS || STEP_IS_FIXED || EXCHANGE
static int finite_all(const double *a, int n)
{
    int i;
    for (i = 0; i < n; ++i) {
        if (!isfinite(a[i])) return 0;
    }
    return 1;
}
#endif

#if EQUATIONS
static double norm_of(const double *a, int n)
{
    double sum = 0.0;
    int i;
    for (i = 0; i < n; ++i) sum += a[i] * a[i];
    return sqrt(sum);
}
#endif

#if EQUATIONS
/* Solve A x = b by Gaussian elimination with pivoting; overwrite A, and b by x. 0 if singular. */
static int solved(int n, double *A, double *b)
{
    int i, j, k;
    for (k = 0; k < n; ++k) {
        int pivot = k;
        for (i = k + 1; i < n; ++i) {
            if (fabs(A[i + k * n]) > fabs(A[pivot + k * n])) pivot = i;
        }
        if (!(fabs(A[pivot + k * n]) > 0.0)) return 0;
        if (pivot != k) {
            double swap = b[k];
            b[k] = b[pivot];
            b[pivot] = swap;
            for (j = k; j < n; ++j) {
                swap = A[k + j * n];
                A[k + j * n] = A[pivot + j * n];
                A[pivot + j * n] = swap;
            }
        }
        for (i = k + 1; i < n; ++i) {
            const double factor = A[i + k * n] / A[k + k * n];
            if (factor != 0.0) {
                for (j = k + 1; j < n; ++j) A[i + j * n] -= factor * A[k + j * n];
                b[i] -= factor * b[k];
            }
        }
    }
    for (k = n - 1; k >= 0; --k) {
        for (j = k + 1; j < n; ++j) b[k] -= A[k + j * n] * b[j];
        b[k] /= A[k + k * n];
    }
    return finite_all(b, n);
}
#endif

#if BASIS
/* Compute an orthonormal basis V (n, n - m) of the null space of A (m, n): the trailing columns of
   the product of Householder reflections of its transpose. */
static void null_space(int m, int n, const double *A, double *V)
{
    double Q[COORDINATES * CONSTRAINTS], beta[CONSTRAINTS];
    int i, j, k;
    for (j = 0; j < m; ++j) {
        for (i = 0; i < n; ++i) Q[i + j * n] = A[j + i * m];
    }
    for (k = 0; k < m; ++k) {
        double *v = Q + k * n, size = norm_of(v + k, n - k);
        const double lead = v[k] > 0.0 ? -size : size;
        size = size * size - v[k] * lead;
        v[k] -= lead;
        beta[k] = size > 0.0 ? 1.0 / size : 0.0;
        for (j = k + 1; j < m; ++j) {
            double dot = 0.0;
            for (i = k; i < n; ++i) dot += v[i] * Q[i + j * n];
            for (i = k; i < n; ++i) Q[i + j * n] -= beta[k] * dot * v[i];
        }
    }
    for (j = 0; j < n - m; ++j) {
        double *column = V + j * n;
        for (i = 0; i < n; ++i) column[i] = i == m + j ? 1.0 : 0.0;
        for (k = m - 1; k >= 0; --k) {
            double dot = 0.0;
            for (i = k; i < n; ++i) dot += Q[i + k * n] * column[i];
            for (i = k; i < n; ++i) column[i] -= beta[k] * dot * Q[i + k * n];
        }
    }
}
#endif
