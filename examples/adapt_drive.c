/* Closed loop of examples/adapt_drive.py on a target: plant, controller, estimator, compensator.
 * Friction doubles within a minute. Prints the RMS error [m] with the scales of the law, with those
 * of the estimator, and with the true ones. */
#include <math.h>
#include <stdio.h>

#include "cascade_f64.h"
#include "friction_compensator_f64.h"
#include "friction_estimator_f64.h"
#include "plant_f64.h"

enum { FIXED, ADAPTED, RIGHT, SAMPLES = 60000, SUBSTEPS = 10 };

static double rms_error(int scales)
{
    const double h = 1e-3, size = 0.02, w = 2.0 * 3.14159265358979 * 0.5, limit = 100.0;
    cascade_f64_state_t controller = cascade_f64_start;
    friction_estimator_f64_state_t learnt = friction_estimator_f64_start;
    friction_compensator_f64_state_t added = friction_compensator_f64_start;
    friction_compensator_f64_param_t numbers = friction_compensator_f64_default;
    plant_f64_state_t axis = plant_f64_start;
    plant_f64_param_t wear = plant_f64_default;
    double acting = 0.0, next = 0.0, sum = 0.0;
    int k, j;

    for (k = 0; k < SAMPLES; k++) {
        const double level = 1.0 + (double)k / SAMPLES, t = h * k;
        const double v_ref = size * w * sin(w * t), a_ref = size * w * w * cos(w * t);
        const cascade_f64_in_t seen = {axis.x, size * (1.0 - cos(w * t)), v_ref, a_ref, 0.0};
        cascade_f64_out_t command;
        friction_estimator_f64_out_t found;
        friction_compensator_f64_out_t force;
        plant_f64_out_t result;

        cascade_f64_step(&controller, &seen, &command);
        {
            const friction_estimator_f64_in_t moved = {command.v_m, acting, 1.0};
            friction_estimator_f64_step(&learnt, &friction_estimator_f64_default, &moved, &found);
        }
        if (scales == ADAPTED) {
            numbers.scale_coulomb = found.scale_coulomb;
            numbers.scale_viscous = found.scale_viscous;
            numbers.offset = found.offset;
        } else if (scales == RIGHT) {
            numbers.scale_coulomb = level;
        }
        {
            const friction_compensator_f64_in_t now = {v_ref, command.e, command.v_m, 1.0};
            friction_compensator_f64_step(&added, &numbers, &now, &force);
        }
        acting = next; /* a delay of one sample */
        next = fmin(fmax(command.u + force.F, -limit), limit);
        wear.mu_s = level * plant_f64_default.mu_s;
        wear.mu_d = level * plant_f64_default.mu_d;
        for (j = 0; j < SUBSTEPS; j++) {
            const plant_f64_in_t input = {acting};
            plant_f64_step(&axis, &wear, &input, &result);
        }
        sum += (axis.x - size * (1.0 - cos(w * (t + h)))) * (axis.x - size * (1.0 - cos(w * (t + h))));
    }
    return sqrt(sum / SAMPLES);
}

int main(void)
{
    printf("%.9g %.9g %.9g\n", rms_error(FIXED), rms_error(ADAPTED), rms_error(RIGHT));
    return 0;
}
