@head
 *
 * Each row is an independent step: states before the step, inputs, at most one parameter that is
 * changed by @share of its default, states after the step, and outputs.
 * States: @states.
 *
 * A number passes if it differs from the result of CasADi in double precision by at most its
 * tolerance. The tolerance is the larger of two numbers: @base of the peak of the signal over all
 * rows, which covers rounding, functions of math.h and fused multiply-add, since these differ
 * between compilers and targets; and @roundings times the change that rounding to this type causes
 * in nine of ten rows, which is larger for differences of large numbers.
 */
#ifndef @{macro}_VECTORS_H
#define @{macro}_VECTORS_H

#include <math.h>

#define @{macro}_VECTORS @count

typedef struct {
@members
} @{name}_vector_t;

@tolerances

static const @{name}_vector_t @{name}_vectors[@{macro}_VECTORS] = {
@rows
};

#endif
