/* FMI 3.0: functions shared by co-simulation and model exchange. */

/* Functions of the standard have arguments that some units do not use. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

static Instance *unit_of(fmi3Instance c) { return (Instance *)c; }

/* Report the last message, always an error or a refusal, to the importer. */
static fmi3Status told(Instance *unit, fmi3Status status, const char *category)
{
    if (unit->logger) {
        ((fmi3LogMessageCallback)unit->logger)(unit->environment, status, category, unit->said);
    }
    return status;
}

static fmi3Status failed(Instance *unit)
{
    return told(unit, fmi3Error, "logStatusError");
}

static fmi3Status refused(Instance *unit)
{
    return told(unit, fmi3Discard, "logStatusDiscard");
}

/* Return 1 if a call is allowed in this phase; otherwise report an error. */
static int allowed(Instance *unit, const char *call, Phase first, Phase last)
{
    if (!unit) return 0;
    if (unit->m.phase >= first && unit->m.phase <= last) return 1;
    snprintf(unit->said, SAID, "%s: not allowed %s", call, phase_names[unit->m.phase]);
    (void)failed(unit);
    return 0;
}

/* Create an instance; return NULL if the description belongs to another binary. */
static fmi3Instance made(fmi3String name, fmi3String token, fmi3Boolean on,
                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    Instance *unit = (Instance *)calloc(1, sizeof *unit);
    if (!unit) return NULL;
    snprintf(unit->name, sizeof unit->name, "%s", name ? name : MODEL_NAME);
    unit->logger = (void (*)(void))log;
    unit->environment = environment;
    fresh(&unit->m);
    if (!token || strcmp(token, MODEL_TOKEN) != 0) {
        snprintf(unit->said, SAID, "instantiate %s: expected the token %s, got another; "
                 "modelDescription.xml and binary do not belong together", MODEL_NAME, MODEL_TOKEN);
        (void)failed(unit);
        free(unit);
        return NULL;
    }
    return unit;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n,
                               const fmi3String categories[])
{
    return c ? fmi3OK : fmi3Error;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean on,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    Instance *unit = unit_of(c);
    if (!allowed(unit, "fmi3EnterInitializationMode", INSTANTIATED, INSTANTIATED)) return fmi3Error;
    if (!has_tolerance) tolerance = unit->m.R[AT_RTOL];
    if (!initialise(unit, start, has_stop, stop, tolerance)) return failed(unit);
    unit->m.phase = INITIALISING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    Instance *unit = unit_of(c);
    if (!allowed(unit, "fmi3ExitInitializationMode", INITIALISING, INITIALISING)) return fmi3Error;
    if (!settled(unit)) return failed(unit);
    unit->m.phase = RUNNING;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c)
{
    if (!allowed(unit_of(c), "fmi3Terminate", RUNNING, BROKEN)) return fmi3Error;
    unit_of(c)->m.phase = ENDED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    if (!c) return fmi3Error;
    fresh(&unit_of(c)->m);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                          fmi3Float64 values[], size_t n_values)
{
    size_t i;
    if (!c || n != n_values) return fmi3Error;
    for (i = 0; i < n; ++i) {
        if (!get(unit_of(c), references[i], values + i)) return failed(unit_of(c));
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                          const fmi3Float64 values[], size_t n_values)
{
    size_t i;
    fmi3Status worst = fmi3OK;
    if (!allowed(unit_of(c), "fmi3SetFloat64", INSTANTIATED, RUNNING)) return fmi3Error;
    if (n != n_values) return fmi3Error;
    for (i = 0; i < n; ++i) {
        const Outcome found = set(unit_of(c), references[i], values[i]);
        if (found == FAILED) return failed(unit_of(c));
        if (found == REFUSED) worst = refused(unit_of(c));
    }
    return worst;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return c && state && kept(&unit_of(c)->m, state) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    return c && state && put_back(unit_of(c), state) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    if (!c || !state) return fmi3Error;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    *size = sizeof(Memory);
    return c ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    if (!c || !state || size < sizeof(Memory)) return fmi3Error;
    memcpy(bytes, state, sizeof(Memory));
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    if (!c || !state) return fmi3Error;
    return unpacked(unit_of(c), bytes, size, state) ? fmi3OK : failed(unit_of(c));
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[],
    size_t n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64
    seeds[], size_t n_seeds, fmi3Float64 values[], size_t n_values)
{
    if (!c || n_seeds != n_knowns || n_values != n_unknowns) return fmi3Error;
    return directional(unit_of(c), unknowns, n_unknowns, knowns, n_knowns, seeds, values)
               ? fmi3OK
               : failed(unit_of(c));
}
