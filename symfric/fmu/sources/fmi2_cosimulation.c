/* FMI 2.0: communication steps. */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference references[],
                                       size_t n, const fmi2Integer orders[],
                                       const fmi2Real values[])
{
    return n ? fmi2Error : fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference references[],
                                        size_t n, const fmi2Integer orders[], fmi2Real values[])
{
    return n ? fmi2Error : fmi2OK;
}

/* Return fmi2Discard for an invalid communication step, which has no effect, and if a terminal
   event ended it early (fmi2Terminated); return an error if steps fail. fmi2LastSuccessfulTime is
   the time reached in each case. */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_return)
{
    Instance *unit = unit_of(c);
    if (!allowed(unit, "fmi2DoStep", RUNNING, ENDED)) return fmi2Error;
    switch (advance(unit, time, size)) {
    case DONE:
    case EARLY: /* not requested */
        return fmi2OK;
    case OVER:
    case REFUSED:
        return refused(unit);
    case FAILED:
    default:
        return failed(unit);
    }
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return fmi2Error;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    return fmi2Discard;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (!c || kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = unit_of(c)->m.t;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (!c || kind != fmi2Terminated) return fmi2Discard;
    *value = unit_of(c)->m.phase == ENDED;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    return fmi2Discard;
}
