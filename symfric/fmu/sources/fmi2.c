/* FMI 2.0: functions shared by co-simulation and model exchange. */

/* Functions of the standard have arguments that some units do not use. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

static Instance *unit_of(fmi2Component c) { return (Instance *)c; }

/* Report the last message, always an error or a refusal, to the importer. The message is a format
   string there, and # marks a variable. */
static fmi2Status told(Instance *unit, fmi2Status status, const char *category)
{
    const fmi2CallbackFunctions *functions = (const fmi2CallbackFunctions *)unit->callbacks;
    char text[2 * SAID];
    size_t i, k = 0;
    for (i = 0; unit->said[i] && k + 2 < sizeof text; ++i) {
        if (unit->said[i] == '%' || unit->said[i] == '#') text[k++] = unit->said[i];
        text[k++] = unit->said[i];
    }
    text[k] = 0;
    if (functions && functions->logger) {
        functions->logger(functions->componentEnvironment, unit->name, status, category, text);
    }
    return status;
}

static fmi2Status failed(Instance *unit)
{
    return told(unit, fmi2Error, "logStatusError");
}

static fmi2Status refused(Instance *unit)
{
    return told(unit, fmi2Discard, "logStatusDiscard");
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

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String categories[])
{
    return c ? fmi2OK : fmi2Error;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean on)
{
    Instance *unit = (Instance *)calloc(1, sizeof *unit);
    if (!unit) return NULL;
    snprintf(unit->name, sizeof unit->name, "%s", name ? name : MODEL_NAME);
    unit->callbacks = functions;
    fresh(&unit->m);
    if (type != (EXCHANGE ? fmi2ModelExchange : fmi2CoSimulation) || !guid || strcmp(guid, MODEL_TOKEN) != 0) {
        snprintf(unit->said, SAID, "instantiate %s: expected its own kind and the guid %s, got "
                 "another; modelDescription.xml and binary do not belong together", MODEL_NAME,
                 MODEL_TOKEN);
        (void)failed(unit);
        free(unit);
        return NULL;
    }
    return unit;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    Instance *unit = unit_of(c);
    if (!allowed(unit, "fmi2SetupExperiment", INSTANTIATED, INSTANTIATED)) return fmi2Error;
    if (!has_tolerance) tolerance = unit->m.R[AT_RTOL];
    return initialise(unit, start, has_stop, stop, tolerance) ? fmi2OK : failed(unit);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *unit = unit_of(c);
    if (!allowed(unit, "fmi2EnterInitializationMode", INSTANTIATED, INSTANTIATED)) return fmi2Error;
    unit->m.phase = INITIALISING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Instance *unit = unit_of(c);
    if (!allowed(unit, "fmi2ExitInitializationMode", INITIALISING, INITIALISING)) return fmi2Error;
    if (!settled(unit)) return failed(unit);
    unit->m.phase = RUNNING;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    if (!allowed(unit_of(c), "fmi2Terminate", RUNNING, BROKEN)) return fmi2Error;
    unit_of(c)->m.phase = ENDED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    if (!c) return fmi2Error;
    fresh(&unit_of(c)->m);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t n,
                       fmi2Real values[])
{
    size_t i;
    if (!c) return fmi2Error;
    for (i = 0; i < n; ++i) {
        if (!get(unit_of(c), references[i], values + i)) return failed(unit_of(c));
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t n,
                       const fmi2Real values[])
{
    size_t i;
    fmi2Status worst = fmi2OK;
    if (!allowed(unit_of(c), "fmi2SetReal", INSTANTIATED, RUNNING)) return fmi2Error;
    for (i = 0; i < n; ++i) {
        const Outcome found = set(unit_of(c), references[i], values[i]);
        if (found == FAILED) return failed(unit_of(c));
        if (found == REFUSED) worst = refused(unit_of(c));
    }
    return worst;
}

/* All variables are real. */
#define NONE_OF(type)                                                                             \
    fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference references[], size_t n,    \
                             fmi2##type values[])                                                 \
    {                                                                                             \
        return n ? fmi2Error : fmi2OK;                                                            \
    }                                                                                             \
    fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference references[], size_t n,    \
                             const fmi2##type values[])                                           \
    {                                                                                             \
        return n ? fmi2Error : fmi2OK;                                                            \
    }

NONE_OF(Integer)
NONE_OF(Boolean)
NONE_OF(String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return c && state && kept(&unit_of(c)->m, state) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return c && state && put_back(unit_of(c), state) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!c || !state) return fmi2Error;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    *size = sizeof(Memory);
    return c ? fmi2OK : fmi2Error;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (!c || !state || size < sizeof(Memory)) return fmi2Error;
    memcpy(bytes, state, sizeof(Memory));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    if (!c || !state) return fmi2Error;
    return unpacked(unit_of(c), bytes, size, state) ? fmi2OK : failed(unit_of(c));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t n_unknowns, const fmi2ValueReference knowns[],
                                        size_t n_knowns, const fmi2Real seeds[], fmi2Real values[])
{
    if (!c) return fmi2Error;
    return directional(unit_of(c), unknowns, n_unknowns, knowns, n_knowns, seeds, values)
               ? fmi2OK
               : failed(unit_of(c));
}
