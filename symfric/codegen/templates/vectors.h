@about
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
