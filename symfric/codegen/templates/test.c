@head
 *
 * Unit test of @name: returns the number of wrong results. No stdio is needed.
 * Define @{macro}_TEST_PRINT to print them, and @{macro}_TEST_NO_MAIN to call
 * @{name}_test() from elsewhere.
 */
#include "@name.h"
#include "@{name}_vectors.h"

#include <math.h>
#ifdef @{macro}_TEST_PRINT
#include <stdio.h>
#endif

/* Returns the number of wrong results. */
int @{name}_test(void);

/* Returns 1 if a number is wrong or NaN. */
static int @{name}_wrong(@real got, @real wanted, @real tolerance)
{
    return !(fabs@letter(got - wanted) <= tolerance);
}

int @{name}_test(void)
{
@declarations

    for (row = 0; row < @{macro}_VECTORS; row++) {
        const @{name}_vector_t *const vector = &@{name}_vectors[row];
        const int before = failures;
@body
#ifdef @{macro}_TEST_PRINT
        if (failures > before) {
            printf("@name: row %d: %d wrong\n", row, failures - before);
        }
#else
        (void)before;
#endif
    }
    return failures;
}

#ifndef @{macro}_TEST_NO_MAIN
int main(void)
{
    return @{name}_test() == 0 ? 0 : 1;
}
#endif
