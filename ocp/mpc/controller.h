@banner
 *
 * Model predictive controller of '@model': every @step s, over @count intervals.
 * Quadratic programs by Riccati's recursion and an interior point: no allocation, bounded loops.
 */
#ifndef @guard
#define @guard

#ifdef __cplusplus
extern "C" {
#endif

@statuses
/* A change of the plan. */
typedef struct {
@change    double slope, curvature;
} @{name}_move_t;

/* Plan and work space; nothing in it needs to be read or written. */
typedef struct {
    int warm;                /* whether there is a plan */
@memory    @{name}_move_t go, aim;
} @{name}_t;

typedef struct {
@param    int iterations;          /* quadratic programs in a cycle at most; 1: real-time iteration */
} @{name}_param_t;

extern const @{name}_param_t @{name}_default;

typedef struct {
@into} @{name}_in_t;

typedef struct {
@out    int iterations;          /* quadratic programs */
    int program_iterations;  /* of the interior point, over all of them */
    int status;              /* one of @{name}_CONVERGED ... */
    int converged;           /* 1: residual <= tolerance */
} @{name}_out_t;

/* Forget the plan; call it before the first step. */
void @{name}_init(@{name}_t *self);

/* One cycle. Numbers that are not finite give @{name}_BAD_INPUT, and the last plan goes on. */
void @{name}_step(@{name}_t *self, const @{name}_param_t *param, const @{name}_in_t *in,
@indent@{name}_out_t *out);

#ifdef __cplusplus
}
#endif

#endif /* @guard */
