/* FMI 2.0: model exchange. */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return allowed(unit_of(c), "fmi2EnterEventMode", RUNNING, RUNNING) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    Instance *unit = unit_of(c);
    int again, moved;
    Outcome found;
    if (!allowed(unit, "fmi2NewDiscreteStates", RUNNING, RUNNING)) return fmi2Error;
    found = carried_out(unit, &again, &moved);
    info->newDiscreteStatesNeeded = again && found != OVER;
    info->terminateSimulation = found == OVER;
    info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = moved;
    info->nextEventTimeDefined = fmi2False;
    info->nextEventTime = 0.0;
    return found == FAILED ? failed(unit) : fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return allowed(unit_of(c), "fmi2EnterContinuousTimeMode", RUNNING, RUNNING) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return,
                                       fmi2Boolean *event_mode, fmi2Boolean *terminate)
{
    if (!allowed(unit_of(c), "fmi2CompletedIntegratorStep", RUNNING, RUNNING)) return fmi2Error;
    *event_mode = completed(unit_of(c));
    *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    if (!allowed(unit_of(c), "fmi2SetTime", RUNNING, RUNNING)) return fmi2Error;
    return at_time(unit_of(c), time) ? fmi2OK : failed(unit_of(c));
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    if (!allowed(unit_of(c), "fmi2SetContinuousStates", RUNNING, RUNNING)) return fmi2Error;
    return at_state(unit_of(c), x, n) ? fmi2OK : failed(unit_of(c));
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t n)
{
    if (!c || n != NX) return fmi2Error;
    if (!settled(unit_of(c)) || !rated(unit_of(c))) return failed(unit_of(c));
    memcpy(derivatives, unit_of(c)->m.rates, NX * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t n)
{
    if (!c || n != CROSSINGS) return fmi2Error;
    if (!settled(unit_of(c)) || !rated(unit_of(c))) return failed(unit_of(c));
    if (n) memcpy(indicators, unit_of(c)->m.rates + NX, n * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    if (!c || n != NX) return fmi2Error;
    if (!settled(unit_of(c))) return failed(unit_of(c));
    memcpy(x, unit_of(c)->m.S + MEMORY, NX * sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t n)
{
    if (!c || n != NX) return fmi2Error;
    memcpy(nominals, model_nominal, NX * sizeof(double));
    return fmi2OK;
}
