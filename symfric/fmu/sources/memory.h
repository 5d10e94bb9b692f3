/* Memory of an instance: plain numbers, so that a copy of them is a state of the unit. */

#ifndef SYMFRIC_MEMORY_H
#define SYMFRIC_MEMORY_H

/* Positions in the columns of an attempt: S = (t, h, h_old, growth_old, rejected, y),
   R = (t_end, rtol, h_max, atol, d) with d = (parameters, inputs). */
enum { AT_T, AT_H, AT_H_OLD, AT_GROWTH, AT_REJECTED, MEMORY };
enum { AT_END, AT_RTOL, AT_H_MAX, FIXED };
enum { DATA = FIXED + NX, GIVEN = DATA + ND };
/* Record of an accepted step: t0, t1, y0, y1, and the rows of its dense output. */
enum { RECORD = 2 + (2 + ROWS) * N };

/* Reasons to stop; the first three are returned by the search for events. */
enum { TERMINAL = 4, STORM, FOLLOW, UNSOLVED, TINY, MANY, EVENT };

typedef enum { INSTANTIATED, INITIALISING, RUNNING, ENDED, BROKEN } Phase;

/* Result of a call. EARLY: an event ended the communication step; OVER: a terminal event occurred;
   REFUSED: the call had no effect. */
typedef enum { DONE, EARLY, OVER, REFUSED, FAILED } Outcome;

typedef struct {
    unsigned long long kind;          /* token of the model */
    Phase phase;
    int settled;                      /* 1 if the start values are consistent with the values set */
    int seen;                         /* 1 if `out` is up to date */
    int rated;                        /* 1 if `rates` is up to date */
    int quiet;                        /* 1 if nothing jumped at the last communication point */
    int stopped;                      /* reason to stop after the last step, by events */
    int returns;                      /* 1 if events end communication steps early */
    int happened;                     /* 1 if the last step ends at an event, not yet reported */
    int limited;                      /* 1 if nothing may be computed beyond `stop` */
    double begin, t, stop;            /* start, communication point, end [s] */
    double attempts;                  /* number of all steps so far */
    double S[MEMORY + N];             /* memory and unknowns of the step, which may be beyond t */
    double base[MEMORY + N];          /* the same, before the last accepted step */
    double R[GIVEN + 1];              /* numbers that a step does not change */
    double row[RECORD];               /* record of the last accepted step */
    double set[ND + 1];               /* parameters and inputs as set; R has those in use */
    double known[NX + 1];             /* start values of states that were set */
    double chosen[NX + 1];            /* 1 for each state that was set */
    double guess[NZ + 1];             /* initial guess of algebraic variables */
    double out[NS + 1];               /* all signals at t */
    double rates[NX + CROSSINGS + 1]; /* model exchange: rates of states, event indicators */
    double events[EVENT_MEMORY + 1];  /* memory of the search for events */
    double events_base[EVENT_MEMORY + 1]; /* the same, before the last accepted step */
    double jump[JUMP + 1];            /* record of the last event */
} Memory;

enum { SAID = 600 };

typedef struct {
    Memory m;
    char said[SAID];                  /* the last message */
    char name[120];
    const void *callbacks;            /* callbacks of the importer in FMI 2.0 */
    void *environment;                /* environment of the importer in FMI 3.0 */
    void (*logger)(void);
} Instance;

#endif
