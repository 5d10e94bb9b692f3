/* A loop at 1 kHz on Linux; see hardware_in_the_loop.py. */
#define _POSIX_C_SOURCE 200809L
#include "drive_f64.h"
#include "friction_compensator_f32.h"
#include <math.h>
#include <stdio.h>
#include <time.h>

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(void)
{
    drive_f64_state_t plant = drive_f64_start;
    drive_f64_in_t force = {0};
    drive_f64_out_t out;
    friction_compensator_f32_state_t memory = friction_compensator_f32_start;
    friction_compensator_f32_in_t in = {0};
    friction_compensator_f32_out_t friction;
    struct timespec due;
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (int k = 0; k < CYCLES; k++) {
        due.tv_nsec += 1000000;
        if (due.tv_nsec >= 1000000000) { due.tv_nsec -= 1000000000; due.tv_sec++; }
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
        const double begin = now(), t = 1e-3 * k, w = 6.283185307179586;
        const double x = plant.x, v = plant.v; /* inputs: encoder */
        in.v_ref = (float)(0.02 * w * cos(w * t));
        in.v = (float)v;
        in.enable = 1.0f;
        (void)friction_compensator_f32_step(&memory, &friction_compensator_f32_default, &in,
                                            &friction);
        force.force = 4000.0 * (0.02 * sin(w * t) - x) + 80.0 * (in.v_ref - v) + friction.F;
        /* outputs: motor current */
        for (int i = 0; i < STEPS; i++) {
            (void)drive_f64_step(&plant, &drive_f64_default, &force, &out);
        }
        const double end = now(), late = begin - (double)due.tv_sec - 1e-9 * (double)due.tv_nsec;
        printf("%.17g %.17g %.9g %.9g\n", x, force.force, late, end - begin);
    }
    return 0;
}
