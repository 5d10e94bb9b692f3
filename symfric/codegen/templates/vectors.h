@head
 *
 * Independent steps: the states before, the inputs, one parameter that is changed (by
 * @share of its default) or none, and the states after and the outputs.
 * States: @states.
 *
 * A number passes if it differs from the result of CasADi in double precision by no more than its
 * tolerance: @base of the peak of its signal over all rows, for the rounding of a few operations,
 * of the functions of math.h and of fused multiply-add, which differ between compilers and targets; or
 * @roundings times what rounding to this type changes in nine of ten rows, where that is more,
 * as in differences of large numbers.
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
