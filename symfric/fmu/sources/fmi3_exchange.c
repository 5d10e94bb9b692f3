/* FMI 3.0: model exchange. */

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean on,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    return made(name, token, on, environment, log);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    return allowed(unit_of(c), "fmi3EnterEventMode", RUNNING, RUNNING) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    return allowed(unit_of(c), "fmi3EvaluateDiscreteStates", RUNNING, RUNNING) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *values_changed,
                                    fmi3Boolean *has_next, fmi3Float64 *next)
{
    Instance *unit = unit_of(c);
    int more, moved;
    Outcome found;
    if (!allowed(unit, "fmi3UpdateDiscreteStates", RUNNING, RUNNING)) return fmi3Error;
    found = carried_out(unit, &more, &moved);
    *again = more && found != OVER;
    *terminate = found == OVER;
    *nominals_changed = fmi3False;
    *values_changed = moved != 0;
    *has_next = fmi3False;
    *next = 0.0;
    return found == FAILED ? failed(unit) : fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return allowed(unit_of(c), "fmi3EnterContinuousTimeMode", RUNNING, RUNNING) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_return,
                                       fmi3Boolean *event_mode, fmi3Boolean *terminate)
{
    if (!allowed(unit_of(c), "fmi3CompletedIntegratorStep", RUNNING, RUNNING)) return fmi3Error;
    *event_mode = completed(unit_of(c)) != 0;
    *terminate = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    if (!allowed(unit_of(c), "fmi3SetTime", RUNNING, RUNNING)) return fmi3Error;
    return at_time(unit_of(c), time) ? fmi3OK : failed(unit_of(c));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    if (!allowed(unit_of(c), "fmi3SetContinuousStates", RUNNING, RUNNING)) return fmi3Error;
    return at_state(unit_of(c), x, n) ? fmi3OK : failed(unit_of(c));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t n)
{
    if (!c || n != NX) return fmi3Error;
    if (!settled(unit_of(c)) || !rated(unit_of(c))) return failed(unit_of(c));
    memcpy(derivatives, unit_of(c)->m.rates, NX * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t n)
{
    if (!c || n != CROSSINGS) return fmi3Error;
    if (!settled(unit_of(c)) || !rated(unit_of(c))) return failed(unit_of(c));
    if (n) memcpy(indicators, unit_of(c)->m.rates + NX, n * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    if (!c || n != NX) return fmi3Error;
    if (!settled(unit_of(c))) return failed(unit_of(c));
    memcpy(x, unit_of(c)->m.S + MEMORY, NX * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n)
{
    if (!c || n != NX) return fmi3Error;
    memcpy(nominals, model_nominal, NX * sizeof(double));
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    *n = CROSSINGS;
    return c ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    *n = NX;
    return c ? fmi3OK : fmi3Error;
}
