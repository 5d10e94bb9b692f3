/* What one instance remembers: plain numbers, so that a state of the unit is a copy of them. */

#ifndef SYMFRIC_MEMORY_H
#define SYMFRIC_MEMORY_H

/* Places in the columns of an attempt: S = (t, h, h_old, growth_old, rejected, y),
   R = (t_end, rtol, h_max, atol, d) with d = (parameters, inputs). */
enum { AT_T, AT_H, AT_H_OLD, AT_GROWTH, AT_REJECTED, MEMORY };
enum { AT_END, AT_RTOL, AT_H_MAX, FIXED };
enum { DATA = FIXED + NX, GIVEN = DATA + ND };
/* A record of an accepted step: t0, t1, y0, y1, and the rows of its dense output. */
enum { RECORD = 2 + (2 + ROWS) * N };

/* Why steps stop; the first three are what the search for events asks for. */
enum { TERMINAL = 4, STORM, FOLLOW, UNSOLVED, TINY, MANY };

typedef enum { INSTANTIATED, INITIALISING, RUNNING, ENDED, BROKEN } Phase;

/* How a call ended. OVER: a terminal event; REFUSED: nothing was done. */
typedef enum { DONE, OVER, REFUSED, FAILED } Outcome;

typedef struct {
    unsigned long long kind;          /* of which model */
    Phase phase;
    int settled;                      /* whether the start values are consistent with what was set */
    int seen;                         /* whether `out` is up to date, */
    int rated;                        /* and whether `rates` is */
    int quiet;                        /* communication points in a row at which nothing jumped */
    int stopped;                      /* what the events behind the last step ask for */
    int limited;                      /* whether nothing may be computed behind `stop` */
    double begin, t, stop;            /* start, communication point, end [s] */
    double attempts;                  /* of all steps so far */
    double S[MEMORY + N];             /* the step: its memory and unknowns; it may stand beyond t */
    double base[MEMORY + N];          /* the same before the last accepted step */
    double R[GIVEN + 1];              /* what a step does not change */
    double row[RECORD];               /* the last accepted step */
    double set[ND + 1];               /* parameters and inputs as set; R has those in force */
    double known[NX + 1];             /* start values of states that were set, */
    double chosen[NX + 1];            /* and which were */
    double guess[NZ + 1];             /* where the search for algebraic variables begins */
    double out[NS + 1];               /* all signals at t */
    double rates[NX + CROSSINGS + 1]; /* model exchange: rates of states, event indicators */
    double events[EVENT_MEMORY + 1];  /* of the search for events, now */
    double events_base[EVENT_MEMORY + 1]; /* and before the last accepted step */
    double jump[JUMP + 1];            /* the last event */
} Memory;

enum { SAID = 600 };

typedef struct {
    Memory m;
    char said[SAID];                  /* the last message */
    char name[120];
    const void *callbacks;            /* of the importer, FMI 2.0 */
    void *environment;                /* and FMI 3.0 */
    void (*logger)(void);
} Instance;

#endif
